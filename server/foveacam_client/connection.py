"""Settings of the connection to a server: address, token, certificate, timeouts, retries."""

import os
import ssl
from dataclasses import dataclass, field
from pathlib import Path

import httpx

from foveacam_client.problems import ClientError
from foveacam_client.retries import RetryPolicy

URL_VARIABLE = "FOVEACAM_URL"
TOKEN_VARIABLE = "FOVEACAM_TOKEN"  # noqa: S105 - a name
DEFAULT_URL = "http://127.0.0.1:8000"


@dataclass(frozen=True, slots=True, kw_only=True)
class Connection:
    """Address and credentials of a server; `ca_file`: PEM of the authority that signed its certificate.

    `timeout_s`: for connecting, and for each wait for more bytes. Proxies of the environment are not used.
    """

    url: str = DEFAULT_URL
    token: str | None = field(default=None, repr=False)
    ca_file: Path | None = None
    timeout_s: float = 30.0
    retries: RetryPolicy = field(default_factory=RetryPolicy)

    @property
    def headers(self) -> dict[str, str]:
        """The headers of every request."""
        return {} if self.token is None else {"Authorization": f"Bearer {self.token}"}

    @property
    def verify(self) -> ssl.SSLContext | bool:
        """The TLS context by which httpx verifies certificates."""
        if self.base_url.scheme == "http":
            return False  # reading the system's authorities takes 50 ms
        if self.ca_file is None:
            return True
        try:
            return ssl.create_default_context(cafile=self.ca_file)
        except OSError as error:
            raise ClientError(
                f"certificate {self.ca_file}: it cannot be read ({error}); give a PEM file"
            ) from error

    @property
    def base_url(self) -> httpx.URL:
        """The server's address."""
        try:
            found = httpx.URL(self.url)
        except httpx.InvalidURL as error:
            raise ClientError(
                f"{self.url!r} is no address ({error}); give one such as {DEFAULT_URL}"
            ) from error
        if found.scheme not in ("http", "https") or not found.host:
            raise ClientError(f"{self.url!r} is no address of a server; give one such as {DEFAULT_URL}")
        return found


def token_of(token: str | None, token_file: Path | str | None) -> str | None:
    """Return the given token, else that of the file, else that of the environment."""
    if token is not None:
        return token
    if token_file is None:
        return os.environ.get(TOKEN_VARIABLE) or None
    try:
        return Path(token_file).read_text(encoding="utf-8").strip()
    except OSError as error:
        raise ClientError(f"token file {token_file}: it cannot be read ({error})") from error
