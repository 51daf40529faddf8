"""Live feeds of AIS: set up here, received by the worker."""
