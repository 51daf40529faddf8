"""The feature of keeping an installation for years: backups, checks, repeated hashing."""
