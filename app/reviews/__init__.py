"""The feature of poses and their reviews."""
