"""Schemas of calibrations: description, health, comparison, events."""

from typing import Literal, Self

from foveacam_pipeline.calibrate.records.compare import CalibrationComparison, DifferenceSpread
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.foundation.names import age_s
from foveacam_server.foundation.quantities import deg, rounded
from foveacam_server.foundation.schema import ResponseModel


class SpreadDocument(ResponseModel):
    """Root mean square and largest difference, px."""

    rms: float
    max: float

    @classmethod
    def of(cls, spread: DifferenceSpread) -> Self:
        """Return a spread rounded to the precision that is meaningful in pixels."""
        return cls(rms=round(spread.rms_px, 4), max=round(spread.max_px, 4))


class ComparisonDocument(ResponseModel):
    """Differences of two calibrations: fovea px, and wide px for the wide camera."""

    a: str
    b: str
    distance_m: float
    pointing_difference_px: SpreadDocument
    epipolar_difference_px: SpreadDocument
    disparity_difference_px: SpreadDocument
    wide_px: SpreadDocument
    baseline_m: float
    """Baseline of b minus that of a."""
    picture_url: str

    @classmethod
    def of(cls, found: CalibrationComparison, *, picture_url: str) -> Self:
        """Return REST's document of a comparison."""
        return cls(
            a=found.a,
            b=found.b,
            distance_m=found.distance_m,
            pointing_difference_px=SpreadDocument.of(found.pointing),
            epipolar_difference_px=SpreadDocument.of(found.epipolar),
            disparity_difference_px=SpreadDocument.of(found.disparity),
            wide_px=SpreadDocument.of(found.wide),
            baseline_m=round(found.baseline_m, 7),
            picture_url=picture_url,
        )


class WideLensDocument(ResponseModel):
    """The calibrated wide lens, for turning pixels into directions: OpenCV's k1 k2 p1 p2 k3."""

    width: int
    height: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: list[float]


class HealthDocument(ResponseModel):
    """Errors of the calibration in force, as medians over recent ordinary fixations."""

    score: float | None
    """Residuals over the largest that the stated errors allow: above 1 it is time to calibrate."""
    verdict: Literal["good", "recalibrate", "unknown"]
    fixations: int
    vertical_px: float | None
    horizontal_px: float | None
    rows_px: float | None
    """Vertical difference between the directions of the two eyes."""
    detail: str


class CalibrationDocument(ResponseModel):
    """A calibration and its standard errors."""

    id: str
    label: str
    origin: str
    rig_id: str
    created_utc: str
    age_s: float
    baseline_m: float
    mirror_sigma_deg: float
    rectify_sigma_px: float | None
    wide: WideLensDocument
    current: bool
    """Whether it is in force."""
    kept: bool
    """Whether it is in the data directory; those that ship with the program cannot be discarded."""
    parent_id: str | None
    """Id of the calibration that it corrects."""
    session_id: str | None
    """Id of the session that measured it."""
    health: HealthDocument | None
    """Health; only of the calibration in force."""

    @classmethod
    def of(
        cls, calibration: Calibration, *, kept: bool, current: bool, health: HealthDocument | None = None
    ) -> "CalibrationDocument":
        """Describe a calibration; `health` is known of the one in force."""
        eyes = (calibration.left, calibration.right)
        return cls(
            id=calibration.id,
            label=calibration.label,
            origin=calibration.origin,
            rig_id=calibration.rig_id,
            created_utc=calibration.created_utc,
            age_s=round(age_s(calibration.created_utc), 1),
            baseline_m=calibration.baseline_m,
            mirror_sigma_deg=deg(max(max(eye.mirror.sigma_rad) for eye in eyes)),
            rectify_sigma_px=rounded(max(eye.homography.loo_px for eye in eyes), 3),
            wide=WideLensDocument.model_validate(calibration.wide, from_attributes=True),
            current=current,
            kept=kept,
            parent_id=calibration.parent_id,
            session_id=calibration.session_id,
            health=health,
        )


class CalibrationChosen(ResponseModel):
    """Data of `rig.calibration`: the calibration that came into force."""

    id: str
    label: str
    origin: str


class CalibrationMissing(ResponseModel):
    """Data of `rig.calibration` where none came into force: why."""

    detail: str
