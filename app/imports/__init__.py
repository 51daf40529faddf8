"""Bulk import: folders, many files and zips, looked at before they are committed as one batch."""
