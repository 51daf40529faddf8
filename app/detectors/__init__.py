"""The feature of detector models."""
