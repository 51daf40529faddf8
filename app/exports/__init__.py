"""Exports: poses as files that other tools open."""
