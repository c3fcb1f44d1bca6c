"""Schemas of depth backends: those there are, the choice, and what a check found."""

from typing import Annotated, Literal

from pydantic import StringConstraints

from foveacam_server.foundation.schema import RequestModel, ResponseModel

BackendName = Annotated[str, StringConstraints(pattern=r"^[a-z0-9][a-z0-9_-]{0,39}$")]


class DepthBackendDocument(ResponseModel):
    """One backend."""

    name: str
    kind: Literal["built_in", "network"]
    licence: str
    research_only: bool
    """Whether the licence allows research alone: whoever chooses it confirms that."""
    sha256: str | None
    """Of the graph of a network."""
    problem: str | None
    """Why it cannot be used, None where nothing is known against it."""


class DepthBackendsDocument(ResponseModel):
    """All backends and the one in use."""

    in_use: str
    fallback: str | None
    """Why the last look was matched by `sgbm` instead of the backend in use; None when it was not."""
    backends: list[DepthBackendDocument]


class DepthBackendChoice(RequestModel):
    """Which backend computes the depth of looks from now on."""

    name: BackendName
    research_confirmed: bool = False
    """Confirms that the use is research, as the licence of such a network wants."""


class DepthBackendChange(ResponseModel):
    """Data of the events of depth backends."""

    name: str
    detail: str


class NetworkFindingDocument(ResponseModel):
    """One check of a network."""

    what: str
    passed: bool
    found: str
    remedy: str


class NetworkCheckDocument(ResponseModel):
    """What a check of a network found on a pair whose disparities are known."""

    name: str
    passed: bool
    findings: list[NetworkFindingDocument]
    error_median_px: float | None
    compute_ms: float | None
    sgbm_ms: float | None
    """Time of semi-global matching on the same pair."""


class StoredChoice(ResponseModel):
    """The file `networks/in_use.json`."""

    name: str
