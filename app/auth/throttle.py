"""Guessing passwords is made slow: so many failures in a moving window, then 429 for a while.

Failures are counted for the account and for the address they come from, until the oldest has left
the window.

The counts live in this process's memory. One web process is what the design has; several would each
count for themselves, which multiplies the allowance by their number and opens nothing else. Unknown
accounts are counted like known ones, so the answer tells nothing.

Passwords are checked one at a time: an argon2 check takes 64 MiB, so a flood of sign-ins would
otherwise take all the memory there is, and parallel guesses would slip through between the count
and the check.
"""

import hashlib
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from math import ceil

import structlog
from limits import RateLimitItemPerSecond
from limits.storage import MemoryStorage
from limits.strategies import MovingWindowRateLimiter

from app.errors import TooManyRequests, Unavailable

LONGEST_WAIT_S = 5.0
_log = structlog.get_logger("quaymark.sign_in")


class Attempt:
    """One sign-in under way; it is told how it ended."""

    def __init__(self, throttle: "SignInThrottle", account: str, address: str) -> None:
        self._throttle = throttle
        self._account = account
        self._address = address

    def failed(self) -> None:
        """Count a failure against the account and the address."""
        self._throttle.count("account", self._account)
        self._throttle.count("address", self._address)

    def succeeded(self) -> None:
        """Forget the account's failures; whoever knows the password is not guessing."""
        self._throttle.forget(self._account)


class SignInThrottle:
    """Counts failed sign-ins in a moving window."""

    def __init__(self, attempts: int, window_s: int) -> None:
        self._item = RateLimitItemPerSecond(attempts, window_s)
        self._limiter = MovingWindowRateLimiter(MemoryStorage())
        self._one_at_a_time = threading.Lock()

    @contextmanager
    def attempt(self, email: str, address: str) -> Iterator[Attempt]:
        """Let one sign-in try. Raises TooManyRequests, or Unavailable when too many queue."""
        account = hashlib.sha256(email.strip().lower().encode()).hexdigest()
        if not self._one_at_a_time.acquire(timeout=LONGEST_WAIT_S):
            raise Unavailable("too many people sign in just now", headers={"Retry-After": "5"})
        try:
            self.check("account", account)
            self.check("address", address)
            yield Attempt(self, account, address)
        finally:
            self._one_at_a_time.release()

    def check(self, kind: str, key: str) -> None:
        """Raise TooManyRequests while too many failures of a kind count against a key."""
        if self._limiter.test(self._item, kind, key):
            return
        leaves_at = self._limiter.get_window_stats(self._item, kind, key).reset_time
        wait_s = max(1, ceil(leaves_at - time.time()))
        _log.warning("sign_in_throttled", by=kind, wait_s=wait_s)
        raise TooManyRequests(
            f"too many tries; try again in {wait_s} seconds",
            headers={"Retry-After": str(wait_s)},
        )

    def count(self, kind: str, key: str) -> None:
        """Count a failure."""
        self._limiter.hit(self._item, kind, key)

    def count_wish(self, email: str, address: str) -> None:
        """Count a wish for a mail. Raises TooManyRequests, alike for known and unknown people."""
        account = hashlib.sha256(email.strip().lower().encode()).hexdigest()
        for kind, key in (("account", account), ("address", address)):
            self.check(kind, key)
            self.count(kind, key)

    def forget(self, account: str) -> None:
        """Forget an account's failures."""
        self._limiter.clear(self._item, "account", account)
