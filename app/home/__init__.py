"""The first page: what to do next, for a newcomer and for a reviewer."""
