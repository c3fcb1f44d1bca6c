"""Describes a calibration for REST."""

from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.foundation.names import age_s
from foveacam_server.foundation.rounding import deg, rounded
from foveacam_server.resources.calibrations.schema import (
    CalibrationDocument,
    HealthDocument,
    WideLensDocument,
)


def calibration_document(
    calibration: Calibration, *, kept: bool, current: bool = False, health: HealthDocument | None = None
) -> CalibrationDocument:
    """Return what the operator needs to know of a calibration; `health` is known of the one in force.

    `kept`: whether it is the user's own, a file of the data directory.
    """
    eyes = (calibration.left, calibration.right)
    return CalibrationDocument(
        id=calibration.id,
        label=calibration.label,
        origin=calibration.origin,
        rig_id=calibration.rig_id,
        created_utc=calibration.created_utc,
        age_s=round(age_s(calibration.created_utc), 1),
        baseline_m=calibration.baseline_m,
        mirror_sigma_deg=deg(max(max(eye.mirror.sigma_rad) for eye in eyes)),
        rectify_sigma_px=rounded(max(eye.homography.loo_px for eye in eyes), 3),
        wide=_wide_lens(calibration),
        current=current,
        kept=kept,
        parent_id=calibration.parent_id,
        session_id=calibration.session_id,
        health=health,
    )


def _wide_lens(calibration: Calibration) -> WideLensDocument:
    """Return the wide lens, by which the page turns pixels into directions."""
    wide = calibration.wide
    return WideLensDocument(
        width=wide.width,
        height=wide.height,
        fx_px=wide.fx_px,
        fy_px=wide.fy_px,
        cx_px=wide.cx_px,
        cy_px=wide.cy_px,
        distortion=list(wide.distortion),
    )
