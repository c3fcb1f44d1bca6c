"""The sentences of a drift check for the operator."""

import math

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.drift.drift_values import DriftCheck, DriftSettings
from foveacam_pipeline.verge.aim import EYES


def words(found: DriftCheck, *, settings: DriftSettings, f_px: float) -> str:
    """Return what was found, what it means, and what could not be seen."""
    return " ".join(
        [
            _agreement(found),
            *(_height(found, f_px) if found.height_alone else (_eye(found, role) for role in EYES)),
            _vergence(found, f_px),
            _verdict(found, settings),
        ]
    )


def _agreement(found: DriftCheck) -> str:
    return (
        f"{found.agreeing} of {len(found.places)} places agree, to {found.residual_px:.1f} fovea px, "
        f"after {found.looks} looks."
    )


def _eye(found: DriftCheck, role: Role) -> str:
    eye = found.eye(role)
    ax_deg, ay_deg = (math.degrees(angle) for angle in eye.turn.shift_rad)
    roll_deg = math.degrees(eye.turn.turn_rad[2])
    return (
        f"The {role} eye is off by {ax_deg:+.4f}° across, {ay_deg:+.4f}° down and {roll_deg:+.3f}° of roll: "
        f"{eye.moved_px:.1f} ± {eye.sigma_px:.1f} px over the field."
    )


def _height(found: DriftCheck, f_px: float) -> tuple[str]:
    apart_px = f_px * (found.right.turn.shift_rad[1] - found.left.turn.shift_rad[1])
    sigma_px = f_px * (found.left.shift_sigma_rad[1] + found.right.shift_sigma_rad[1])
    where = "lower" if apart_px > 0.0 else "higher"
    return (
        "Each eye looks where it should, within its own error, but the right one "
        f"{abs(apart_px):.1f} ± {sigma_px:.1f} px {where} than the left: that alone has drifted.",
    )


def _vergence(found: DriftCheck, f_px: float) -> str:
    if found.vergence_known:
        return "The angle between the eyes was checked at a known distance."
    unseen = (
        "The angle between the eyes cannot be told from depth here and was left alone: tell the distance of "
        "what stands in the middle of the view, or show the marker target"
    )
    if found.vergence_sigma_rad > 0.0:
        apart_px = 2.0 * found.vergence_sigma_rad * f_px
        return f"{unseen}; it may be wrong by ± {apart_px:.0f} px, which distances now state."
    return f"{unseen}."


def _verdict(found: DriftCheck, settings: DriftSettings) -> str:
    if not found.locked and found.duration_s > settings.longest_s:
        return (
            f"No lock: time was up after {found.duration_s:.0f} s; the cameras or the computer are too slow. "
            "End what else keeps it busy, then check again."
        )
    if not found.locked:
        return (
            f"No lock: at least {settings.least_places} places all over the field must agree; look at a "
            "scene with more texture that stands still, or calibrate the mirrors again."
        )
    if found.significant:
        return "What has drifted is well beyond its own error."
    return "That is within its own error: nothing to correct."
