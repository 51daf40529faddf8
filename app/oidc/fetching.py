"""Calls to the identity provider: to a judged address, within a time, of a size, without detours.

The issuer is the operator's word, but what its discovery document names is the provider's. So every
address is resolved once and judged (`app.addresses`), and the connection goes to the judged number,
with the name in the certificate and the Host header. Redirects are not followed.
"""

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit, urlunsplit

import structlog

from app.addresses import AddressError, ForbiddenAddressError, resolve
from app.errors import Unavailable
from app.oidc.settings import ProviderSettings

MOST_BYTES = 2**20
_log = structlog.get_logger("quaymark.oidc")
_PORTS = {"https": 443, "http": 80}


@dataclass(frozen=True, slots=True)
class Answer:
    """A status and the JSON object that came with it; empty where it was none."""

    status: int
    content: Mapping[str, Any]


def fetch(
    settings: ProviderSettings,
    url: str,
    *,
    form: Mapping[str, str] | None = None,
    headers: Mapping[str, str] | None = None,
) -> Answer:
    """Ask for a JSON object; with a form, by POST. Raises Unavailable when none can be had."""
    import httpx  # noqa: PLC0415  heavy, and only for installations with a provider

    parts = urlsplit(url)
    host = parts.hostname or ""
    schemes = _PORTS if settings.oidc_allowed_networks else {"https"}
    if parts.scheme not in schemes:
        raise _unavailable(url, "no https address")
    until_s = time.monotonic() + settings.oidc_timeout_s
    try:
        # Resolved in the request's own thread: name servers are waited for, too.
        place = resolve(host, parts.port or _PORTS[parts.scheme], settings.oidc_allowed_networks)
        numbered = urlunsplit(parts._replace(netloc=str(place)))
        with (
            httpx.Client(
                timeout=settings.oidc_timeout_s,
                verify=httpx.create_ssl_context(),
                trust_env=False,
                follow_redirects=False,
            ) as client,
            client.stream(
                "GET" if form is None else "POST",
                numbered,
                data=form,
                headers={"Accept": "application/json", **(headers or {}), "Host": parts.netloc},
                extensions={"sni_hostname": host},
            ) as response,
        ):
            body = bytearray()
            for chunk in response.iter_bytes():
                body += chunk
                if len(body) > MOST_BYTES or time.monotonic() > until_s:
                    raise _unavailable(url, "an answer too long or too slow")
            return Answer(response.status_code, _object(bytes(body)))
    except ForbiddenAddressError as error:
        reason = str(error).replace("QUAYMARK_FEED_", "QUAYMARK_OIDC_")
        raise _unavailable(url, reason) from error
    except (AddressError, httpx.HTTPError, httpx.InvalidURL, OSError) as error:
        raise _unavailable(url, str(error) or type(error).__name__) from error


def _object(body: bytes) -> Mapping[str, Any]:
    try:
        content = json.loads(body)
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}


def _unavailable(url: str, reason: str) -> Unavailable:
    _log.warning("the identity provider cannot be asked", url=url.partition("?")[0], reason=reason)
    return Unavailable(
        "the identity provider does not answer as it should; try again in a moment, or tell an "
        "administrator, who finds the reason in the server's log",
        headers={"Retry-After": "10"},
    )
