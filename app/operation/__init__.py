"""Running an installation: serving, working, migrating, the demo, the benchmarks."""
