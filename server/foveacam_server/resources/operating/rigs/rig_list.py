"""The file that names the rigs of a lab (TOML): `[[rig]]` with `name`, `url` and perhaps `token_file`."""

import tomllib
from pathlib import Path
from typing import Annotated

from pydantic import AnyHttpUrl, BaseModel, ConfigDict, Field, ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.plain_words import explain_validation

MOST_RIGS = 64


class NamedRig(BaseModel):
    """A rig of the file."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Annotated[str, Field(min_length=1, max_length=80)]
    url: AnyHttpUrl
    token_file: Path | None = None
    """File with the token of a service that may view that rig; a relative path is one beside the list."""


class _RigList(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    rig: Annotated[list[NamedRig], Field(max_length=MOST_RIGS)]


def read_rig_list(path: Path) -> tuple[NamedRig, ...]:
    """Return the rigs listed in a file; raise `InvalidInput` for a file that cannot be used."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise _refused(path, reason or "it cannot be read") from error
    try:
        rigs = _RigList.model_validate(content).rig
    except ValidationError as error:
        raise _refused(path, explain_validation(error.errors()).detail) from error
    names = [rig.name for rig in rigs]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise _refused(path, f"it names {twice[0]} twice")
    return tuple(
        rig if rig.token_file is None else rig.model_copy(update={"token_file": path.parent / rig.token_file})
        for rig in rigs
    )


def _refused(path: Path, reason: str) -> InvalidInput:
    return InvalidInput(
        f"the list of rigs {path} cannot be used: {reason}",
        asked=str(path),
        found=reason,
        remedy='write for each rig [[rig]], name = "…", url = "http://…", and perhaps token_file = "…"',
    )
