"""The identity provider: where it is, what it signs with, and whether a token is really its.

What discovery says and the keys are kept for a while. A token signed by an unknown key makes the
keys be fetched anew, which is how providers change them; but not more often than every few seconds.
A token counts only with one of the asymmetric algorithms: `none`, and a shared secret that the
client's secret could be mistaken for, never do.
"""

import secrets
import time
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlencode

import structlog

from app.errors import Forbidden, Unavailable
from app.oidc.fetching import Answer, fetch
from app.oidc.pending import Pending
from app.oidc.settings import ProviderSettings

if TYPE_CHECKING:
    from joserfc.jwk import KeySet

ALGORITHMS = (
    *("RS256", "RS384", "RS512", "PS256", "PS384", "PS512"),
    *("ES256", "ES384", "ES512", "EdDSA", "Ed25519"),
)
KEPT_FOR_S = 3600.0
REFETCH_AFTER_S = 5.0
CALLBACK = "/sign-in/provider/callback"
NOT_TRUSTED = "what the identity provider sent is not to be trusted; nothing was stored"
_log = structlog.get_logger("quaymark.oidc")
Claims = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Found:
    """What discovery told, and when."""

    document: Mapping[str, Any]
    keys: "KeySet"
    at_s: float


class Provider:
    """One identity provider, for one installation."""

    def __init__(self, settings: ProviderSettings) -> None:
        self._settings = settings
        self._found: Found | None = None
        self.callback = settings.public_url.rstrip("/") + CALLBACK

    def address(self, pending: Pending) -> str:
        """Return where a browser goes to sign in. Raises Unavailable."""
        from authlib.oauth2.rfc7636 import (  # noqa: PLC0415  only with a provider
            create_s256_code_challenge,
        )

        asked = {
            "response_type": "code",
            "client_id": self._settings.oidc_client_id,
            "redirect_uri": self.callback,
            "scope": self._settings.oidc_scopes,
            "state": pending.state,
            "nonce": pending.nonce,
            "code_challenge": create_s256_code_challenge(pending.verifier),
            "code_challenge_method": "S256",
        }
        return _with_query(self._endpoint("authorization_endpoint"), asked)

    def sign_out_address(self) -> str | None:
        """Return where a browser signs out of the provider too; None where it has no such place."""
        place = self._discovered().document.get("end_session_endpoint")
        if not isinstance(place, str):
            return None
        back = self._settings.public_url.rstrip("/") + "/sign-in"
        asked = {"client_id": self._settings.oidc_client_id, "post_logout_redirect_uri": back}
        return _with_query(place, asked)

    def redeem(self, code: str, pending: Pending) -> Claims:
        """Turn a code into what the provider says about a person.

        Raises Unavailable when the provider does not answer, Forbidden when it refuses the code or
        when its ID token is not one for us, for this sign-in, and for now.
        """
        answer = self._ask_for_tokens(code, pending.verifier)
        id_token, access_token = (answer.content.get(k) for k in ("id_token", "access_token"))
        if answer.status != 200 or not isinstance(id_token, str):
            _log.warning(
                "the code was refused", status=answer.status, error=answer.content.get("error")
            )
            raise Forbidden("the identity provider refused this sign-in; begin again")
        access_token = access_token if isinstance(access_token, str) else ""
        claims = self._checked(id_token, access_token, pending.nonce)
        return {**self._told_apart(claims, access_token), **claims}

    def _ask_for_tokens(self, code: str, verifier: str) -> Answer:
        client_id, secret = self._settings.oidc_client_id, self._settings.provider_secret()
        form = {
            "grant_type": "authorization_code",
            "code": code,
            "redirect_uri": self.callback,
            "code_verifier": verifier,
        }
        headers = {}
        document = self._discovered().document
        methods = document.get("token_endpoint_auth_methods_supported", ["client_secret_basic"])
        if secret and "client_secret_basic" in methods:
            pair = f"{quote(client_id, safe='')}:{quote(secret, safe='')}"
            headers["Authorization"] = f"Basic {b64encode(pair.encode()).decode()}"
        else:
            form |= {"client_id": client_id} | ({"client_secret": secret} if secret else {})
        return fetch(self._settings, self._endpoint("token_endpoint"), form=form, headers=headers)

    def _checked(self, id_token: str, access_token: str, nonce: str) -> Claims:
        from authlib.oidc.core import CodeIDToken  # noqa: PLC0415  only with a provider
        from joserfc import jwt  # noqa: PLC0415
        from joserfc.errors import JoseError  # noqa: PLC0415

        try:
            token = jwt.decode(id_token, self._discovered().keys, algorithms=ALGORITHMS)
        except (JoseError, ValueError):
            token = None
        try:
            if token is None:  # the provider may have changed its keys since
                token = jwt.decode(id_token, self._keys_anew(), algorithms=ALGORITHMS)
            claims = CodeIDToken(
                token.claims,
                token.header,
                options={
                    "iss": {"essential": True, "value": self._settings.oidc_issuer},
                    "aud": {"essential": True, "value": self._settings.oidc_client_id},
                    "sub": {"essential": True},
                },
                params={
                    "nonce": nonce,
                    "client_id": self._settings.oidc_client_id,
                    "access_token": access_token,
                },
            )
            claims.validate(leeway=self._settings.oidc_leeway_s)
        except (JoseError, ValueError, TypeError) as error:
            _log.warning("an ID token is not to be trusted", reason=str(error))
            raise Forbidden(NOT_TRUSTED) from error
        subject = claims["sub"]
        if not isinstance(subject, str) or not 0 < len(subject) <= 255:
            raise Forbidden(NOT_TRUSTED)
        return dict(claims)

    def _told_apart(self, claims: Claims, access_token: str) -> Claims:
        """Return what the provider tells only when asked, if the token lacks the address."""
        place = self._discovered().document.get("userinfo_endpoint")
        if "email" in claims or not access_token or not isinstance(place, str):
            return {}
        bearer = {"Authorization": f"Bearer {access_token}"}
        answer = fetch(self._settings, place, headers=bearer)
        if answer.status != 200 or answer.content.get("sub") != claims["sub"]:
            raise Forbidden(NOT_TRUSTED)
        return answer.content

    def _endpoint(self, name: str) -> str:
        place = self._discovered().document.get(name)
        if not isinstance(place, str):
            _log.warning("discovery lacks an endpoint", endpoint=name)
            raise Unavailable("the identity provider does not say where to sign in")
        return place

    def _keys_anew(self) -> "KeySet":
        found = self._discovered()
        if time.monotonic() - found.at_s < REFETCH_AFTER_S:
            return found.keys
        self._found = None
        return self._discovered().keys

    def _discovered(self) -> Found:
        found = self._found
        if found is not None and time.monotonic() - found.at_s < KEPT_FOR_S:
            return found
        issuer = self._settings.oidc_issuer
        place = f"{issuer.rstrip('/')}/.well-known/openid-configuration"
        document = fetch(self._settings, place).content
        if document.get("issuer") != issuer or not isinstance(document.get("jwks_uri"), str):
            _log.warning(
                "discovery is of another issuer", wanted=issuer, got=document.get("issuer")
            )
            raise Unavailable("the identity provider's discovery document is another's, or none")
        keys = _key_set(fetch(self._settings, document["jwks_uri"]).content)
        self._found = Found(document, keys, time.monotonic())
        return self._found


def new_pending(destination: str) -> Pending:
    """Return a sign-in about to begin, with fresh secrets."""
    state, nonce, verifier = (secrets.token_urlsafe(32) for _ in range(3))
    return Pending(state, nonce, verifier, destination)


def _key_set(content: Mapping[str, Any]) -> "KeySet":
    from joserfc.errors import JoseError  # noqa: PLC0415  only with a provider
    from joserfc.jwk import KeySet, import_key  # noqa: PLC0415

    keys = []
    for entry in content.get("keys", []):
        try:
            if entry.get("use", "sig") == "sig" and entry.get("kty") != "oct":
                keys.append(import_key(entry))
        except (JoseError, ValueError, TypeError, KeyError, AttributeError) as error:
            _log.info("a key of the provider is of no use", reason=str(error))
    return KeySet(keys)


def _with_query(address: str, asked: Mapping[str, str]) -> str:
    return f"{address}{'&' if '?' in address else '?'}{urlencode(asked)}"
