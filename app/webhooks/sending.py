"""One try to deliver: to a judged address, within a time, without detours.

The receiver's address is an operator's word and its name may lead elsewhere tomorrow. So the name
is resolved at each try, every address it leads to is judged (`app.addresses`), and the connection
goes to the judged number, with the name in the certificate and the Host header. A redirect is a
failure: it would lead past all that.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import SplitResult, urlsplit, urlunsplit

from app.addresses import AddressError, Destination, check_host, resolve
from app.webhooks.deadline import Deadline

if TYPE_CHECKING:
    import httpx

PORTS = {"https": 443, "http": 80}
MOST_ANSWER_BYTES = 2**16
LONGEST_REASON = 500
OWN_NETWORKS = "QUAYMARK_WEBHOOK_ALLOWED_NETWORKS"


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a try went: the status that was answered, and why it failed; no reason when it went."""

    status: int | None
    reason: str | None


def check_url(url: str) -> str:
    """Return an address that can be sent to. Raises AddressError, saying what is wrong with it."""
    if any(ord(letter) <= 0x20 or ord(letter) == 0x7F for letter in url):
        raise AddressError("holds a space or a control character")
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise AddressError("is no address; write https://example.org/path") from error
    if parts.scheme not in PORTS or not parts.hostname or port == 0:
        raise AddressError("is no web address; write https://example.org/path")
    if parts.username is not None or parts.password is not None or parts.fragment:
        raise AddressError("must name neither a user nor a part of a page")
    check_host(parts.hostname)
    return url


def destination(url: str, allowed_networks: Sequence[str]) -> Destination:
    """Resolve and judge where an address leads to. Raises AddressError."""
    parts = urlsplit(check_url(url))
    if parts.scheme != "https" and not allowed_networks:
        raise AddressError("must begin with https://")
    try:
        return resolve(parts.hostname or "", _port(parts), allowed_networks)
    except AddressError as error:
        raise AddressError(
            str(error).replace("QUAYMARK_FEED_ALLOWED_NETWORKS", OWN_NETWORKS)
        ) from error


def deliver(
    url: str,
    body: bytes,
    headers: Mapping[str, str],
    *,
    allowed_networks: Sequence[str],
    timeout_s: float,
) -> Outcome:
    """Send a body once; every failure is an outcome with a reason."""
    import httpx  # noqa: PLC0415  heavy, and only for sites with webhooks

    deadline = Deadline(timeout_s)
    try:
        parts = urlsplit(url)
        place = destination(url, allowed_networks)
        with (
            deadline,
            httpx.Client(timeout=timeout_s, trust_env=False, follow_redirects=False) as client,
            client.stream(
                "POST",
                urlunsplit(parts._replace(netloc=str(place))),
                content=body,
                headers={
                    "Content-Type": "application/json",
                    "User-Agent": "Quaymark",
                    **headers,
                    "Host": parts.netloc,
                },
                extensions={"sni_hostname": parts.hostname, "trace": deadline.trace},
            ) as response,
        ):
            _listen(response)
            return _judged(response.status_code)
    except (AddressError, httpx.HTTPError, httpx.InvalidURL, OSError, ValueError) as error:
        if deadline.is_over:
            return Outcome(None, f"has not answered within {timeout_s:g} s")
        return Outcome(None, (str(error) or type(error).__name__)[:LONGEST_REASON])


def _listen(response: "httpx.Response") -> None:
    """Hear a little: what it says is of no interest; that it took the delivery is."""
    import httpx  # noqa: PLC0415  as above

    taken = 0
    with suppress(httpx.HTTPError):
        for chunk in response.iter_raw():
            taken += len(chunk)
            if taken > MOST_ANSWER_BYTES:
                break


def _judged(status: int) -> Outcome:
    if 200 <= status < 300:
        return Outcome(status, None)
    if 300 <= status < 400:
        return Outcome(status, f"answers {status}; redirects are not followed")
    return Outcome(status, f"answers {status}")


def _port(parts: SplitResult) -> int:
    return parts.port or PORTS[parts.scheme]
