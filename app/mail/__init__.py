"""Mail: what is written to people, and the job that sends it."""
