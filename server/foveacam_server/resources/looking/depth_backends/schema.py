"""Schemas of depth backends: list, choice, check of a network, comparison of two."""

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
    """Whether the licence allows research only; choosing it then needs `research_confirmed`."""
    sha256: str | None
    """SHA-256 of a network's graph."""
    problem: str | None
    """Why it cannot be used; None when it can."""


class DepthBackendsDocument(ResponseModel):
    """All backends and the one in use."""

    in_use: str
    fallback: str | None
    """Why the last look was matched by `sgbm` instead of the backend in use; None when it was not."""
    backends: list[DepthBackendDocument]


class DepthBackendChoice(RequestModel):
    """The backend to use for the depth of looks from now on."""

    name: BackendName
    research_confirmed: bool = False
    """Confirms that the use is research, as the licence of a research-only network requires."""


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
    """Findings of a network's check on a pair with known disparities."""

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


class BackendComparisonRequest(RequestModel):
    """Two backends that are compared on the newest look."""

    first: BackendName
    second: BackendName
    research_confirmed: bool = False
    """Confirms that the use is research, as the licence of a research-only network requires."""


class ComparedBackend(ResponseModel):
    """One side of a comparison."""

    name: str
    sha256: str | None
    known: float
    """Share of the left picture's pixels that have a disparity."""
    compute_ms: float
    sigma_median_px: float | None
    """Median of the standard errors that the backend states."""
    picture_url: str


class BackendComparisonDocument(ResponseModel):
    """Difference of two backends on one look; disparities in px of the rectified window."""

    id: str
    first: ComparedBackend
    second: ComparedBackend
    known_both: float
    median_px: float | None
    """Median of first minus second; None where no pixel has a disparity from both."""
    spread_px: float | None
    """Robust standard deviation of first minus second."""
    within_1: float | None
    """Share of the differences within one stated standard error, taking both backends' errors as
    independent."""
    within_2: float | None
    edges: list[float]
    """Edges of the histogram's bins, in stated standard errors of the difference."""
    shares: list[float]
    limit_px: float
    """Difference at which the picture's colour scale saturates."""
    difference_url: str
    left_url: str
