"""Photographs: taken in by content, kept by SHA-256, shown with previews."""
