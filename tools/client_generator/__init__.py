"""Generates the typed half of the Python client from the OpenAPI document."""
