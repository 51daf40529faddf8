"""Runs: passes of the pipeline over a viewport's images."""
