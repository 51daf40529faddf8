"""Pure geometry, AIS and fusion: see README.md in this folder for the conventions."""
