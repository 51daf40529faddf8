"""Opaque tokens: random, shown once, kept as their SHA-256.

A token is 256 random bits, so a plain fast hash is enough (there is nothing to guess), and whoever
reads the database learns no token that works.
"""

import hashlib
import secrets

TOKEN_PREFIX = "qm_"  # noqa: S105  a recognisable beginning, for secret scanners; no secret
_RANDOM_BYTES = 32


def new_token() -> str:
    """Return a fresh API token or session cookie."""
    return TOKEN_PREFIX + secrets.token_urlsafe(_RANDOM_BYTES)


def token_sha256(token: str) -> str:
    """Return what is stored for a token: its SHA-256 in hex."""
    return hashlib.sha256(token.encode()).hexdigest()
