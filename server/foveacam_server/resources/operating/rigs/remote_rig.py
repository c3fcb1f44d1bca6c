"""Reads state and wide picture from the server of another rig; never changes anything there."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from foveacam_hardware.contract import NotConnected
from foveacam_server.foundation.http.addresses import join_address

if TYPE_CHECKING:
    import httpx

PATIENCE_S = 3.0
MOST_BYTES = 4_000_000
"""Largest answer, that of a picture; a server that sends more is not a rig's."""
SNAPSHOT = "views/wide/snapshot.jpg?scale=2"
_ASKS_WHO_COMES = (401, 403)


@dataclass(frozen=True, slots=True, kw_only=True)
class RemoteRig:
    """Address of another rig's server."""

    id: str
    name: str
    url: str
    """Base address with a trailing slash."""
    announced: bool
    token_file: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RemoteState:
    """State of another rig, as reported by its server."""

    rig_id: str | None
    simulated: bool
    scene: str | None
    state: str
    driver: str | None
    problems: tuple[str, ...]


async def ask_state(rig: RemoteRig) -> RemoteState:
    """Return the state of a rig and the holder of its lease; raise `NotConnected` with the reason."""
    async with _client(rig) as client:
        found = await _document(rig, client, "rig")
        lease = await _document(rig, client, "lease")
    try:
        return RemoteState(
            rig_id=_text(found["rig_id"]),
            simulated=bool(found["simulated"]),
            scene=_text(found["scene"]),
            state=str(found["state"])[:40],
            driver=_text(lease.get("person") or lease.get("holder")),
            problems=tuple(f"{each['device']}: {each['detail']}"[:300] for each in _problems(found)),
        )
    except (KeyError, TypeError) as error:
        raise _not_ours(rig) from error


async def ask_picture(rig: RemoteRig) -> bytes:
    """Return its newest wide picture, JPEG; raise `NotConnected` with the reason."""
    async with _client(rig) as client:
        return await _content(rig, client, SNAPSHOT)


def _client(rig: RemoteRig) -> "httpx.AsyncClient":
    import httpx  # not needed by a server that reads no others

    return httpx.AsyncClient(
        base_url=join_address(rig.url, "/api/v1/"), headers=_headers(rig), timeout=PATIENCE_S, trust_env=False
    )


def _headers(rig: RemoteRig) -> dict[str, str]:
    if rig.token_file is None:
        return {}
    try:
        token = rig.token_file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise NotConnected(
            f"the token of {rig.name} cannot be read from {rig.token_file}: {error}",
            remedy="write a token of a service that may view that rig into the file",
        ) from error
    return {"Authorization": f"Bearer {token}"}


async def _document(rig: RemoteRig, client: "httpx.AsyncClient", path: str) -> Mapping[str, object]:
    try:
        found = json.loads(await _content(rig, client, path))
    except ValueError as error:
        raise _not_ours(rig) from error
    if not isinstance(found, dict):
        raise _not_ours(rig)
    return found


async def _content(rig: RemoteRig, client: "httpx.AsyncClient", path: str) -> bytes:
    from httpx import HTTPError

    content = bytearray()
    try:
        async with client.stream("GET", path) as answer:
            if answer.status_code in _ASKS_WHO_COMES:
                raise NotConnected(
                    f"{rig.name} asks who comes",
                    found=f"status {answer.status_code}",
                    remedy="add a service that may view on its page People, and name a file with its token "
                    "as token_file in the list of rigs",
                )
            answer.raise_for_status()
            async for part in answer.aiter_bytes():
                content += part
                if len(content) > MOST_BYTES:
                    raise _not_ours(rig)
    except HTTPError as error:
        reason = str(error) or type(error).__name__
        raise NotConnected(
            f"{rig.name} does not answer at {rig.url}: {reason}",
            asked=rig.url,
            found=reason,
            remedy="see whether its server runs and is reached from this machine",
        ) from error
    return bytes(content)


def _problems(found: Mapping[str, object]) -> list[Mapping[str, object]]:
    problems = found["problems"]
    if not isinstance(problems, list):
        raise TypeError("problems")
    return problems[:20]


def _text(value: object) -> str | None:
    return None if value is None else str(value)[:120]


def _not_ours(rig: RemoteRig) -> NotConnected:
    return NotConnected(
        f"what answers at {rig.url} is no server of a rig",
        asked=rig.url,
        found="another answer",
        remedy="correct the address in the list of rigs",
    )
