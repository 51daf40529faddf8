"""One-time codes of an authenticator app (TOTP, RFC 6238): six digits that change every 30 s.

Written out, because it is a dozen lines of the standard library. A code is taken in its own step
and one to either side, for clocks that are off, and each step only once: whoever looked over
somebody's shoulder comes too late.
"""

import base64
import hashlib
import hmac
import secrets
from datetime import datetime
from urllib.parse import quote

STEP_S = 30
DIGITS = 6
STEPS_OFF = 1
_SECRET_BYTES = 20  # as long as the SHA-1 that RFC 4226 builds on


def new_secret() -> str:
    """Return a fresh secret in base 32, as authenticator apps take it."""
    return base64.b32encode(secrets.token_bytes(_SECRET_BYTES)).decode()


def code_of_step(secret: str, step: int) -> str:
    """Return the code of a time step (RFC 4226, section 5.3). Raises ValueError for no base 32."""
    digest = hmac.new(base64.b32decode(secret), step.to_bytes(8, "big"), hashlib.sha1).digest()
    at = digest[-1] & 0xF
    number = int.from_bytes(digest[at : at + 4], "big") & 0x7FFF_FFFF
    return str(number % 10**DIGITS).zfill(DIGITS)


def step_of(moment: datetime) -> int:
    """Return the time step a moment lies in."""
    return int(moment.timestamp()) // STEP_S


def matching_step(secret: str, code: str, moment: datetime, last_step: int | None) -> int | None:
    """Return the step whose code was given, later than the last one used; None for a wrong code."""
    given = "".join(code.split())
    now_step = step_of(moment)
    for step in range(now_step - STEPS_OFF, now_step + STEPS_OFF + 1):
        is_new = last_step is None or step > last_step
        if is_new and hmac.compare_digest(code_of_step(secret, step).encode(), given.encode()):
            return step
    return None


def app_address(secret: str, email: str) -> str:
    """Return what the QR code says to an authenticator app."""
    return f"otpauth://totp/Quaymark:{quote(email)}?secret={secret}&issuer=Quaymark"
