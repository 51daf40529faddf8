"""Boxes that people drew: what detectors and poses are measured by."""
