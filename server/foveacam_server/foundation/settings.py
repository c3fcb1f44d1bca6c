"""Settings of the server, from the environment (`FOVEACAM_…`) and the command line."""

import os
import re
import secrets
from collections.abc import Mapping
from ipaddress import ip_address
from pathlib import Path
from typing import Literal
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, SecretStr, ValidationError, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.storage.archive import checked_url
from foveacam_server.foundation.plain_words import explain_validation
from foveacam_server.foundation.private_files import warn_if_readable
from foveacam_server.foundation.watching.log_lines import LogFormat

AUTOMATIC_TOKEN = "auto"  # noqa: S105 - requests a generated token
TOKEN_BYTES = 16
TOKEN_CHARS = 12
"""Least length of a token: with the limit of wrong attempts, a random one cannot be guessed."""


def default_data_dir() -> Path:
    """Return the default data directory (XDG base directories)."""
    root = os.environ.get("XDG_DATA_HOME") or str(Path.home() / ".local" / "share")
    return Path(root) / "foveacam"


class OpenIdSettings(BaseModel):
    """An OpenID Connect provider by which people sign in."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    issuer: str
    """Address of the issuer, below which is `.well-known/openid-configuration`."""
    client_id: str
    client_secret: SecretStr
    name: str = "the lab's account"
    """Name of the provider on the sign-in page's button: Sign in with …"""
    claim: str = "email"
    """Claim of the ID token that is taken as the user's name."""
    new_role: Literal["viewer", "operator", "admin"] | None = None
    """Role of a person not added by an admin; None: such a person is refused."""


OWN_PATHS = frozenset(
    {
        "api",
        "static",
        "docs",
        "redoc",
        "viser",
        "view",
        "windows",
        "replay",
        "display",
        "join",
        "sign_in",
        "session",
    }
)
"""First path segments of the server's own addresses."""
_ORIGIN = re.compile(r"https?://(\[[0-9a-f:]+\]|[a-z0-9._-]+)(:[0-9]{1,5})?")
_ROOT_PATH = re.compile(r"(/[A-Za-z0-9][A-Za-z0-9._~-]*)+")


class Settings(BaseSettings):
    """Settings of the server; the command line overrides the environment."""

    model_config = SettingsConfigDict(
        env_prefix="FOVEACAM_", env_nested_delimiter="__", extra="forbid", frozen=True
    )

    rig: str = "sim"
    """`sim`, or the path of a rig file (TOML)."""
    scene: str = "bench"
    """Scene of the simulated rig: a shipped name, or the path of a scene file."""
    preset: str = "rig120"
    """Mirror dynamics of the simulated rig: `rig120` or `paper`."""
    binning: Literal["1", "2", "rig"] = "rig"
    """Binning of looks and live views; `rig`: the rig's own `working_binning`."""
    replay: Path | None = None
    """A recording to play instead of a rig."""
    replay_speed: float = Field(default=1.0, ge=0.25, le=4.0)
    replay_at_end: Literal["loop", "stop"] = "loop"
    """Whether the recording is played in a loop."""
    host: str = "127.0.0.1"
    port: int = Field(default=8000, ge=0, le=65535)
    token: SecretStr | None = None
    """Shared token with every right. `auto` generates one."""
    tls_cert: Path | None = None
    """Certificate (PEM, with its chain) by which the server speaks https; needs `tls_key`."""
    tls_key: Path | None = None
    insecure: bool = False
    """Whether a server reachable from other machines is open to everybody, without users or a token."""
    openid: OpenIdSettings | None = None
    """`FOVEACAM_OPENID__ISSUER`, `__CLIENT_ID`, `__CLIENT_SECRET` and more; None: only passwords."""
    allowed_origins: tuple[str, ...] = ()
    """Origins (https://HOST[:PORT]) of pages, besides its own, that may use this server."""
    trusted_proxies: tuple[str, ...] = ()
    """Addresses or networks of proxies whose X-Forwarded-For and X-Forwarded-Proto are used."""
    rigs: Path | None = None
    """File that names other rigs of the lab, for the page of all rigs."""
    announce: bool = False
    """Whether to announce this rig in the local network, and to list the rigs announced there."""
    root_path: str = ""
    """Path below which a proxy serves this server, such as `/foveacam`; empty: the root of a site."""
    data: Path = Field(default_factory=default_data_dir)
    archive: str | None = None
    """URL of the archive of captures, recordings and stills: `s3://bucket/prefix`, or `file:///folder`."""
    recording_folders: tuple[Path, ...] = ()
    """Folders of this machine from which recordings may be opened, besides `import` of `data`."""
    cluster: str | None = None
    """Dask scheduler, tcp://HOST:8786, on whose workers batches may run."""
    calibration: Path | None = None
    """Calibration file to use instead of the rig's own."""
    live_wide_hz: float = Field(default=15.0, gt=0.0, le=120.0)
    live_fovea_hz: float = Field(default=15.0, gt=0.0, le=60.0)
    """Highest rate of looks for the live fovea views while the rig is idle."""
    viewer: bool = True
    """Whether the 3D pane (viser) runs."""
    log_format: LogFormat = "text"
    """Format of the log: text, or one JSON object per line."""
    otlp_endpoint: str | None = None
    """Address of a collector of traces by OTLP over HTTP; None: no traces."""

    @field_validator("token")
    @classmethod
    def _long_enough(cls, token: SecretStr | None) -> SecretStr | None:
        value = "" if token is None else token.get_secret_value()
        if value and value != AUTOMATIC_TOKEN and len(value) < TOKEN_CHARS:
            raise ValueError(
                f"a token has at least {TOKEN_CHARS} characters, this one {len(value)}; "
                f"choose a longer one, or '{AUTOMATIC_TOKEN}'"
            )
        return token

    @field_validator("allowed_origins")
    @classmethod
    def _whole_origins(cls, given: tuple[str, ...]) -> tuple[str, ...]:
        origins = tuple(origin.rstrip("/").lower() for origin in given)
        for origin in origins:
            if not _ORIGIN.fullmatch(origin):
                raise ValueError(
                    f"{origin!r} is no origin of a page; give scheme, host and the port that its address "
                    "shows, such as https://lab.example or http://10.0.0.5:3000, without path and without *"
                )
        return origins

    @field_validator("root_path")
    @classmethod
    def _path_of_its_own(cls, given: str) -> str:
        root = given.rstrip("/")
        if root and not _ROOT_PATH.fullmatch(root):
            raise ValueError(
                f"{given!r} is no path below a site; give one such as /foveacam: letters, digits, - _ . ~"
            )
        if root and root.split("/")[1] in OWN_PATHS:
            raise ValueError(
                f"{given!r} begins with an address of the server itself; give one such as /foveacam"
            )
        return root

    @field_validator("otlp_endpoint")
    @classmethod
    def _collector(cls, endpoint: str | None) -> str | None:
        if not endpoint:
            return None
        parts = urlsplit(endpoint)
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.username or parts.password:
            raise ValueError(
                "the address of a collector is like http://127.0.0.1:4318, without name and password; "
                "what it asks for goes into OTEL_EXPORTER_OTLP_HEADERS"
            )
        return endpoint

    @field_validator("archive")
    @classmethod
    def _archive_address(cls, given: str | None) -> str | None:
        return None if given is None else checked_url(given)

    @property
    def wants_token_made(self) -> bool:
        """Whether a token is generated at the start."""
        return self.token is not None and self.token.get_secret_value() == AUTOMATIC_TOKEN

    def with_made_token(self) -> "Settings":
        """Return the same settings with a random token."""
        return self.model_copy(update={"token": SecretStr(secrets.token_urlsafe(TOKEN_BYTES))})

    @property
    def loopback(self) -> bool:
        """Return whether only this machine can reach the server."""
        if self.host == "localhost":
            return True
        try:
            return ip_address(self.host).is_loopback
        except ValueError:
            return False


def checked_settings(chosen: Mapping[str, object]) -> Settings:
    """Return the settings with the command line's values; raise `InvalidInput` for an invalid one."""
    given = {name: value for name, value in chosen.items() if value is not None}
    try:
        return Settings(**given)  # type: ignore[arg-type]  # pydantic checks each value
    except ValidationError as error:
        words = explain_validation(error.errors())
        raise InvalidInput(f"settings (FOVEACAM_… or options): {words.detail}") from error


def given_token(token: str | None, token_file: Path | None) -> str | None:
    """Return the token of the command line: `auto`, the content of a file, or None.

    Raise `InvalidInput` for a token on the command line itself, which all users of the machine can read, and
    for a file that cannot be read.
    """
    if token not in (None, AUTOMATIC_TOKEN):
        raise InvalidInput(
            "--token was given a token, which all users of this machine can see",
            asked="--token with a token",
            found="a secret on the command line",
            remedy="write it to a file and give --token-file FILE, set FOVEACAM_TOKEN, or give --token auto",
        )
    if token_file is None:
        return token
    try:
        warn_if_readable(token_file, what="the token")
        return token_file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text"
        raise InvalidInput(
            f"the token cannot be read from {token_file}: {reason}",
            asked=str(token_file),
            found=reason,
            remedy="give a file with the token as its only line",
        ) from error
