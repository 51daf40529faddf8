"""Loops that keep cameras live: watched folders and standing runs."""
