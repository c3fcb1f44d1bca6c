"""A small OpenID Connect provider for tests: it knows everybody at once, and signs by a key of its own."""

import base64
import hashlib
import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from urllib.parse import urlencode

from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse, RedirectResponse
from joserfc import jwt
from joserfc.jwk import RSAKey

from tests.support.servers.local_server import serving

CLIENT_ID, CLIENT_SECRET = "foveacam", "a-secret-of-both"


@dataclass
class Provider:
    """What the provider says of whoever comes, and how it misbehaves."""

    port: int = 0
    claims: dict[str, object] = field(default_factory=dict)
    wrong_nonce: bool = False
    foreign_key: bool = False
    _key: RSAKey = field(default_factory=lambda: RSAKey.generate_key(2048))
    _other_key: RSAKey = field(default_factory=lambda: RSAKey.generate_key(2048))
    _asked: dict[str, dict[str, str]] = field(default_factory=dict)

    @property
    def issuer(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def configuration(self) -> dict[str, object]:
        return {
            "issuer": self.issuer,
            "authorization_endpoint": f"{self.issuer}/authorize",
            "token_endpoint": f"{self.issuer}/token",
            "jwks_uri": f"{self.issuer}/keys",
            "response_types_supported": ["code"],
            "id_token_signing_alg_values_supported": ["RS256"],
        }

    def keys(self) -> dict[str, object]:
        return {"keys": [self._key.as_dict(private=False, kid="one", alg="RS256", use="sig")]}

    def authorize(self, asked: dict[str, str]) -> str:
        """Return where the browser is sent: back, with a code."""
        assert asked["client_id"] == CLIENT_ID and asked["code_challenge_method"] == "S256"
        code = secrets.token_urlsafe(8)
        self._asked[code] = asked
        return f"{asked['redirect_uri']}?{urlencode({'code': code, 'state': asked['state']})}"

    def token(self, form: dict[str, str], authorization: str) -> dict[str, object]:
        """Return the tokens of a code, which is good once and by the verifier of its challenge alone."""
        asked = self._asked.pop(form["code"])
        digest = hashlib.sha256(form["code_verifier"].encode()).digest()
        assert base64.urlsafe_b64encode(digest).rstrip(b"=").decode() == asked["code_challenge"]
        wanted = base64.b64encode(f"{CLIENT_ID}:{CLIENT_SECRET}".encode()).decode()
        assert authorization == f"Basic {wanted}"
        now_s = int(time.time())
        claims = {
            "iss": self.issuer,
            "aud": CLIENT_ID,
            "sub": "42",
            "iat": now_s,
            "exp": now_s + 60,
            "nonce": "another" if self.wrong_nonce else asked["nonce"],
            **self.claims,
        }
        key = self._other_key if self.foreign_key else self._key
        id_token = jwt.encode({"alg": "RS256", "kid": "one"}, claims, key)
        return {"access_token": "unused", "token_type": "Bearer", "expires_in": 60, "id_token": id_token}


@contextmanager
def serving_provider() -> Iterator[Provider]:
    """Serve a provider on a port of this machine."""
    provider, app = Provider(), FastAPI()

    @app.get("/.well-known/openid-configuration")
    async def configuration() -> JSONResponse:
        return JSONResponse(provider.configuration())

    @app.get("/keys")
    async def keys() -> JSONResponse:
        return JSONResponse(provider.keys())

    @app.get("/authorize")
    async def authorize(request: Request) -> RedirectResponse:
        return RedirectResponse(provider.authorize(dict(request.query_params)), status_code=302)

    @app.post("/token")
    async def token(request: Request) -> JSONResponse:
        form = dict(pair.split("=", 1) for pair in (await request.body()).decode().split("&"))
        return JSONResponse(provider.token(form, request.headers.get("authorization", "")))

    with serving(app) as port:
        provider.port = port
        yield provider
