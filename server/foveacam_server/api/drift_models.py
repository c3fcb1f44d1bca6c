"""The shapes of requests and answers about drift checks."""

from typing import Annotated, Literal

from pydantic import Field

from foveacam_server.api.models import RequestModel, ResponseModel


class DriftRequest(RequestModel):
    """One look at how far the rig has drifted; `distance_m`: of what stands ahead, when known."""

    distance_m: Annotated[float, Field(gt=0.5, le=1000.0)] | None = None
    apply: bool = False


class DriftEyeDocument(ResponseModel):
    """Drift of one eye."""

    eye: Literal["left", "right"]
    shift_x_deg: float
    shift_y_deg: float
    rotation_deg: float
    scale: float
    sigma_deg: float | None
    """Of the shift; null when nothing was seen."""
    significant: bool


class DriftCheckDocument(ResponseModel):
    """What one look found, and what was made of it."""

    id: str
    created_utc: str
    calibration_id: str
    looks: int
    applied: bool
    new_calibration_id: str | None
    eyes: list[DriftEyeDocument]
    vergence_known: bool
    """Whether the angle between the eyes could be told from depth."""
    locked: bool
    """Whether enough places agree."""
    residual_px: float | None
    duration_s: float
    detail: str
