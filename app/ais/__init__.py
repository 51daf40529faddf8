"""AIS recordings: imported with a full accounting, looked up by vessel, time and place."""
