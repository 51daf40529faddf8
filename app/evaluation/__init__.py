"""Evaluation: what a run is worth, against truth where a site has it."""
