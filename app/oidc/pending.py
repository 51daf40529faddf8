"""A sign-in on its way: what the browser keeps while its person is at the identity provider.

State, nonce and PKCE verifier go into a cookie signed with the installation's secret, so that
beginning a sign-in stores nothing here, and what comes back fits only the browser that went.
"""

import hashlib
import hmac
import json
import time
from base64 import urlsafe_b64decode, urlsafe_b64encode
from dataclasses import asdict, dataclass

COOKIE = "quaymark_provider"
PATH = "/sign-in/provider"
LASTS_S = 600


@dataclass(frozen=True, slots=True)
class Pending:
    """What was sent to the provider, and where one wanted to go."""

    state: str
    nonce: str
    verifier: str
    destination: str


def seal(pending: Pending, secret: bytes) -> str:
    """Return the cookie of a sign-in on its way."""
    content = json.dumps({**asdict(pending), "until": int(time.time()) + LASTS_S}).encode()
    return urlsafe_b64encode(_mark(content, secret) + content).decode()


def unseal(cookie: str, secret: bytes) -> Pending | None:
    """Return what a cookie keeps; None for one that is not ours or too old."""
    try:
        raw = urlsafe_b64decode(cookie.encode())
    except ValueError:
        return None
    mark, content = raw[:32], raw[32:]
    if not hmac.compare_digest(mark, _mark(content, secret)):
        return None
    kept = json.loads(content)
    return Pending(**kept) if kept.pop("until") >= time.time() else None


def _mark(content: bytes, secret: bytes) -> bytes:
    return hmac.new(secret, b"sign-in at a provider\0" + content, hashlib.sha256).digest()
