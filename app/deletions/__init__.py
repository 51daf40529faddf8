"""Deleting sites, cameras, viewports, images and runs for a while, and for good."""
