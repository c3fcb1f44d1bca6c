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


class BackendComparisonRequest(RequestModel):
    """Two backends that are compared on the newest look."""

    first: BackendName
    second: BackendName
    research_confirmed: bool = False
    """Confirms that the use is research, as the licence of such a network wants."""


class ComparedBackend(ResponseModel):
    """One side of a comparison."""

    name: str
    sha256: str | None
    known: float
    """Share of the left picture's pixels that have a disparity."""
    compute_ms: float
    sigma_median_px: float | None
    """Median of the errors that it states."""
    picture_url: str


class BackendComparisonDocument(ResponseModel):
    """How two backends differ on one look, disparities in px of the rectified window."""

    id: str
    first: ComparedBackend
    second: ComparedBackend
    known_both: float
    median_px: float | None
    """Of first minus second; None where no pixel is known to both."""
    spread_px: float | None
    """Robust standard deviation of first minus second."""
    within_1: float | None
    """Share of the differences within one stated standard error of a difference of independent errors."""
    within_2: float | None
    edges: list[float]
    """Ends of the histogram's bins, in stated standard errors of the difference."""
    shares: list[float]
    limit_px: float
    """Difference of the picture's full colour."""
    difference_url: str
    left_url: str
