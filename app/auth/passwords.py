"""Passwords: argon2id, and the same work whether or not the account exists.

An answer that comes sooner for unknown addresses tells who has an account; so an unknown address
is checked against a hash that no password fits.
"""

import secrets
from functools import lru_cache

from pwdlib import PasswordHash
from pwdlib.hashers.argon2 import Argon2Hasher

from app.errors import Invalid

SHORTEST_PASSWORD = 10
LONGEST_PASSWORD = 1000

_hasher = PasswordHash((Argon2Hasher(),))


def check_password_strength(password: str) -> None:
    """Raise Invalid for a password that is too short to resist guessing, or absurdly long."""
    if not SHORTEST_PASSWORD <= len(password) <= LONGEST_PASSWORD:
        raise Invalid.field(
            "password",
            f"use {SHORTEST_PASSWORD} to {LONGEST_PASSWORD} characters; a few words together "
            "are easy to keep in mind",
        )


def hash_password(password: str) -> str:
    """Return the salted argon2id hash of a password."""
    return _hasher.hash(password)


def password_fits(password: str, password_hash: str | None) -> bool:
    """Whether a password fits a hash; with None (no such account) as slow, and never."""
    if len(password) > LONGEST_PASSWORD:
        password = ""
    fits = _hasher.verify(password, password_hash or _hash_of_nobody())
    return fits and password_hash is not None


@lru_cache(maxsize=1)
def _hash_of_nobody() -> str:
    return hash_password(secrets.token_urlsafe(32))
