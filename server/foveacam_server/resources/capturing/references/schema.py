"""Schemas of references over a rail's long baselines."""

from typing import Annotated, Literal

from pydantic import Field

from foveacam_server.foundation.quantities import Bracket, Index
from foveacam_server.foundation.schema import JobProgress, Problem, RequestModel, ResponseModel

Place = tuple[float, float, float]


class ReferenceRequest(RequestModel):
    """Settings of a reference.

    `scan`: that whose depth is compared; null: the scan nearest to the middle. `bracket`: index of the
    exposure. `across`: samples over the width of a view. `rail_sigma_m`: standard error of a position on the
    rail; 0: exact.
    """

    scan: Index | None = None
    bracket: Bracket = 0
    across: Annotated[int, Field(ge=2, le=40)] = 10
    rail_sigma_m: Annotated[float, Field(ge=0.0, le=0.05)] = 1e-4


class ReferenceStop(ResponseModel):
    """A scan whose position on the rail is known."""

    scan: int
    rail_m: float


class FoundStop(ResponseModel):
    """A stop of the rail: its reading and its estimated pose, relative to the compared scan's stop.

    `place_m`: (x, y, z), rig frame; its standard errors. `turn_rad`: about x, y, z. `shift_px`: error of the
    gazes, (u, v) of the left and of the right eye, fovea px.
    """

    scan: int
    rail_m: float
    place_m: Place
    sigma_m: Place
    turn_rad: Place
    shift_px: tuple[float, float, float, float]
    observations: int


class ReferenceDepthRange(ResponseModel):
    """Comparison in a range of depths, the rig's own baseline against the reference.

    `expected_*`: error of either baseline's depth for a disparity error that is equal at all depths.
    """

    from_m: float
    to_m: float
    depth_m: float
    samples: int
    bias_m: float
    rms_m: float
    relative_rms: float
    expected_short_m: float
    expected_reference_m: float
    reference_sigma_m: float
    reference_own_sigma_m: float


class ReferenceComparison(ResponseModel):
    """The rig's own baseline against the reference; `wrong`: share of samples apart by more than 5 % of Z.

    Those are excluded from the rest. `stated_sigma_rel`: the reference's own standard error, median.
    """

    samples: int
    wrong: float
    bias_rel: float
    rms_rel: float
    rms_m: float
    disparity_bias_px: float
    disparity_rms_px: float
    stated_sigma_rel: float
    bins: list[ReferenceDepthRange]


class MadeReference(ResponseModel):
    """A finished reference: its request, its figures, its files.

    `samples`: with depth by the rig's own baseline; `referenced`: of those, with a reference. `outliers`:
    share of matches that contradicted the rest. `baseline_m`: median of the longest baselines.
    """

    scan: int
    bracket: int
    across: int
    rail_sigma_m: float
    made_utc: str
    baseline_m: float
    short_baseline_m: float
    points: int
    samples: int
    referenced: int
    matches: int
    outliers: float
    residual_px: float
    noise_factor: float
    stops: list[FoundStop]
    comparison: ReferenceComparison
    svg_url: str
    png_url: str
    samples_url: str


class ReferenceDocument(ResponseModel):
    """The state of a capture's reference, or why none is possible. `stops`: known positions on the rail.

    `outdated`: points were added to the capture since.
    """

    capture_id: str
    name: str
    state: Literal["none", "building", "complete"]
    outdated: bool
    job_id: str | None
    progress: JobProgress | None
    refusal: Problem | None
    stops: list[ReferenceStop]
    brackets: list[int]
    made: MadeReference | None
    url: str
