"""A real identity provider on this machine: discovery, keys, codes, signed tokens; and it can lie.

It lets everybody in at once as `person`. A lie is a name in `lies`, or claims in `claims` that go
over the honest ones.
"""

import base64
import hashlib
import json
import secrets
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any, Self
from urllib.parse import parse_qs, unquote, urlencode, urlsplit

from joserfc import jwt
from joserfc.jwk import OctKey, RSAKey

CLIENT_ID, CLIENT_SECRET = "quaymark", "a secret of both"


class IdentityProvider:
    """One provider; `with IdentityProvider() as provider` serves it."""

    def __init__(self) -> None:
        provider = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                parts = urlsplit(self.path)
                query = {name: values[0] for name, values in parse_qs(parts.query).items()}
                provider.answer(self, parts.path, query)

            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"])).decode()
                form = {name: values[0] for name, values in parse_qs(body).items()}
                provider.answer(self, urlsplit(self.path).path, form)

            def log_message(self, *_arguments: object) -> None:
                """Keep quiet."""

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.issuer = f"http://127.0.0.1:{self._server.server_port}"
        self.person: dict[str, Any] = {
            "sub": "person-1",
            "email": "ada@harbour.example",
            "email_verified": True,
            "name": "Ada Lovelace",
        }
        self.claims: dict[str, Any] = {}
        self.lies: set[str] = set()
        self.key = RSAKey.generate_key(2048, {"kid": "first", "use": "sig"})
        self._codes: dict[str, dict[str, str]] = {}

    def __enter__(self) -> Self:
        threading.Thread(target=self._server.serve_forever, args=(0.02,), daemon=True).start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._server.shutdown()
        self._server.server_close()

    def environment(self) -> dict[str, str]:
        """Return what an installation is told of this provider."""
        return {
            "oidc_issuer": self.issuer,
            "oidc_client_id": CLIENT_ID,
            "oidc_client_secret": CLIENT_SECRET,
            "oidc_button": "Sign in with the harbour's account",
        }

    def change_keys(self) -> None:
        """Sign with another key from now on, and publish only that one."""
        self.key = RSAKey.generate_key(2048, {"kid": secrets.token_hex(4), "use": "sig"})

    def answer(self, request: BaseHTTPRequestHandler, path: str, asked: dict[str, str]) -> None:
        """Answer any request."""
        match path:
            case "/.well-known/openid-configuration":
                self._json(request, 200, self._discovery())
            case "/keys":
                self._json(request, 200, {"keys": [self.key.as_dict(private=False)]})
            case "/authorize":
                self._let_in(request, asked)
            case "/token":
                self._json(request, *self._redeem(request, asked))
            case "/userinfo":
                self._json(request, 200, self.person)
            case _:
                self._json(request, 404, {})

    def _discovery(self) -> dict[str, Any]:
        return {
            "issuer": "http://another.example"
            if "issuer of discovery" in self.lies
            else self.issuer,
            "authorization_endpoint": f"{self.issuer}/authorize",
            "token_endpoint": f"{self.issuer}/token",
            "userinfo_endpoint": f"{self.issuer}/userinfo",
            "end_session_endpoint": f"{self.issuer}/end",
            "jwks_uri": f"{self.issuer}/keys",
        }

    def _let_in(self, request: BaseHTTPRequestHandler, asked: dict[str, str]) -> None:
        code = secrets.token_urlsafe(16)
        self._codes[code] = asked
        back = {"code": code, "state": asked["state"], "iss": self.issuer}
        if "denied" in self.lies:
            back = {"error": "access_denied", "state": asked["state"]}
        request.send_response(302)
        request.send_header("Location", f"{asked['redirect_uri']}?{urlencode(back)}")
        request.end_headers()

    def _redeem(
        self, request: BaseHTTPRequestHandler, asked: dict[str, str]
    ) -> tuple[int, dict[str, Any]]:
        begun = self._codes.pop(asked.get("code", ""), None)
        pair = base64.b64decode(request.headers.get("Authorization", "").partition(" ")[2]).decode()
        name, _, secret = pair.partition(":")
        digest = hashlib.sha256(asked.get("code_verifier", "").encode()).digest()
        challenge = base64.urlsafe_b64encode(digest).rstrip(b"=").decode()
        is_ours = (
            begun is not None
            and (name, unquote(secret)) == (CLIENT_ID, CLIENT_SECRET)
            and begun["code_challenge"] == challenge
            and begun["redirect_uri"] == asked["redirect_uri"]
        )
        if begun is None or not is_ours:
            return 400, {"error": "invalid_grant"}
        tokens = {"access_token": "opaque", "token_type": "Bearer"}
        return 200, tokens | {"id_token": self._id_token(begun["nonce"])}

    def _id_token(self, nonce: str) -> str:
        now = int(time.time())
        claims = {
            "iss": self.issuer,
            "aud": CLIENT_ID,
            "iat": now,
            "exp": now + 300,
            "nonce": nonce,
            **self.person,
            **self.claims,
        }
        claims = {name: value for name, value in claims.items() if value is not None}
        if "no signature" in self.lies:
            head, body = (
                base64.urlsafe_b64encode(json.dumps(part).encode()).rstrip(b"=").decode()
                for part in ({"alg": "none", "typ": "JWT"}, claims)
            )
            return f"{head}.{body}."
        if "shared secret" in self.lies:
            return jwt.encode({"alg": "HS256"}, claims, OctKey.import_key(CLIENT_SECRET))
        key = self.key
        if "other key" in self.lies:
            key = RSAKey.generate_key(2048, {"kid": self.key.kid})
        return jwt.encode({"alg": "RS256", "kid": key.kid}, claims, key)

    @staticmethod
    def _json(request: BaseHTTPRequestHandler, status: int, content: object) -> None:
        body = json.dumps(content).encode()
        request.send_response(status)
        request.send_header("Content-Type", "application/json")
        request.send_header("Content-Length", str(len(body)))
        request.end_headers()
        request.wfile.write(body)
