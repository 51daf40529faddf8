"""Signatures by which a receiver knows that a delivery is ours, fresh and whole.

They follow the Standard Webhooks specification, for which receivers have libraries: over
`id.timestamp.body` with HMAC-SHA256, in the header `webhook-signature` as `v1,` and Base64. While a
secret is being replaced, both sign, and the receiver takes whichever it knows.
"""

import base64
import hashlib
import hmac
import secrets
from collections.abc import Sequence
from datetime import datetime

PREFIX = "whsec_"
SECRET_BYTES = 32


def new_secret() -> str:
    """Return a fresh secret as receivers store it: a prefix and Base64."""
    return PREFIX + base64.b64encode(secrets.token_bytes(SECRET_BYTES)).decode()


def signature(secret: str, identifier: str, timestamp: int, body: bytes) -> str:
    """Return the signature of a delivery by one secret."""
    key = base64.b64decode(secret.removeprefix(PREFIX))
    signed = f"{identifier}.{timestamp}.".encode() + body
    return "v1," + base64.b64encode(hmac.digest(key, signed, hashlib.sha256)).decode()


def headers(keys: Sequence[str], identifier: str, moment: datetime, body: bytes) -> dict[str, str]:
    """Return the headers of a delivery: who it is, when it was sent, signed by each secret."""
    timestamp = int(moment.timestamp())
    return {
        "webhook-id": identifier,
        "webhook-timestamp": str(timestamp),
        "webhook-signature": " ".join(signature(key, identifier, timestamp, body) for key in keys),
    }
