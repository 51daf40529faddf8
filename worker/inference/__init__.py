"""Neural networks: the only place of the project that loads a detector."""
