"""SQL of AIS coverage."""
