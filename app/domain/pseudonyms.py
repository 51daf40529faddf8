"""Pseudonyms of vessels: keyed, the same for ever at one site, another one at every other site.

A plain hash of an MMSI hides nothing, because there are only some hundred million of them to try.
With a key that stays on the server (HMAC, RFC 2104) nobody else can try any. Sixty bits are kept:
among a hundred thousand vessels two share a pseudonym with a chance of one in two hundred million.
"""

import base64
import hashlib
import hmac
import re
import secrets

KEY_BYTES = 32
_LETTERS = 12  # of base 32: 60 bits
_PREFIX = "V-"
PSEUDONYM = re.compile(rf"{_PREFIX}[A-Z2-7]{{{_LETTERS}}}")


def new_key() -> bytes:
    """Return a key for a site."""
    return secrets.token_bytes(KEY_BYTES)


def pseudonym(mmsi: int, key: bytes) -> str:
    """Return what stands for a vessel, such as `V-7KQ2MB5RXA3D`; it does not lead back."""
    digest = hmac.digest(key, f"vessel:{mmsi}".encode(), hashlib.sha256)
    return _PREFIX + base64.b32encode(digest[:10]).decode()[:_LETTERS]


def is_pseudonym(text: str) -> bool:
    """Whether a text has the form of a pseudonym."""
    return PSEUDONYM.fullmatch(text) is not None
