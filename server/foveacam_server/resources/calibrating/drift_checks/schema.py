"""Schemas of drift checks."""

from typing import Annotated

from pydantic import Field

from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.resources.calibrating.sessions.schema import Eye


class DriftRequest(RequestModel):
    """Request of a drift check; `distance_m`: of the scene ahead, when known."""

    distance_m: Annotated[float, Field(gt=0.5, le=1000.0)] | None = None
    apply: bool = False


class DriftEyeDocument(ResponseModel):
    """Drift of one eye."""

    eye: Eye
    shift_x_deg: float
    shift_y_deg: float
    rotation_deg: float
    scale: float
    sigma_deg: float | None
    """Standard error of the shift; null when nothing could be matched."""
    significant: bool


class DriftCheckDocument(ResponseModel):
    """Result of a drift check, and whether it was applied."""

    id: str
    created_utc: str
    calibration_id: str
    looks: int
    applied: bool
    new_calibration_id: str | None
    eyes: list[DriftEyeDocument]
    vergence_known: bool
    """Whether the angle between the eyes could be separated from depth."""
    locked: bool
    """Whether enough patches agree."""
    residual_px: float | None
    duration_s: float
    detail: str
