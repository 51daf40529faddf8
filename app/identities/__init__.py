"""Who a vessel is said to be: its MMSI and name, or a stable pseudonym."""
