"""Table 2 of the paper with the measured values of a rig."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.models.calibration import Calibration, EyeCalibration
from foveacam_pipeline.models.mirror import DAC_STEP_V
from foveacam_pipeline.models.resolution import ahead_rad, px_per_deg
from foveacam_server.resources.calibrating.sessions.schema import SettleAxisDocument

_GRID = 9


@dataclass(frozen=True, slots=True, kw_only=True)
class Specification:
    """One row: the value of the paper's Table 2, the measured value (None: not measured), and a note."""

    group: str
    name: str
    paper: str
    measured: str | None
    note: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _EyeOptics:
    """One eye: field and steering range (x, y), deg, px per degree, motion of one DAC step (x, y), px."""

    field_deg: tuple[float, float]
    steering_deg: tuple[float, float]
    px_per_deg: float
    step_px: tuple[float, float]


def table2(calibration: Calibration, axes: Sequence[SettleAxisDocument]) -> tuple[Specification, ...]:
    """Return the rows of Table 2 for a rig; `axes`: how its mirrors settle, empty where not measured."""
    eyes = [_optics(calibration, role) for role in (Role.LEFT, Role.RIGHT)]
    return (*_fields(calibration, eyes), *_steering(eyes), *_actuation(eyes, axes))


def _fields(calibration: Calibration, eyes: list[_EyeOptics]) -> list[Specification]:
    left, right, top, bottom = np.rad2deg(calibration.wide.field_rad)
    field = _mean([eye.field_deg for eye in eyes])
    resolution = (eyes[0].px_per_deg + eyes[1].px_per_deg) / 2.0
    each = f"left {_box(eyes[0].field_deg, 3)}, right {_box(eyes[1].field_deg, 3)}"
    return [
        Specification(
            group="Optical field of view",
            name="Wide",
            paper="25.6° × 19.4°",
            measured=_box((right - left, bottom - top), 1),
            note="along the axes through the optical centre, lens distortion included",
        ),
        Specification(
            group="Optical field of view",
            name="Fovea",
            paper="2.86° × 2.15°",
            measured=_box(field, 2),
            note=f"mean of both eyes straight ahead, from markers of known size: {each}",
        ),
        Specification(
            group="Angular resolution",
            name="Wide",
            paper="~55 px/°",
            measured=f"{px_per_deg(calibration, Role.WIDE):.1f} px/°",
            note="at the optical centre",
        ),
        Specification(
            group="Angular resolution",
            name="Fovea",
            paper="~502 px/°",
            measured=f"{resolution:.0f} px/°",
            note=f"straight ahead: left {eyes[0].px_per_deg:.1f}, right {eyes[1].px_per_deg:.1f}",
        ),
        Specification(
            group="Effective aperture",
            name="Fovea",
            paper="≈ f/21.5",
            measured=None,
            note="a matter of the lens; no step of the calibration sees it",
        ),
    ]


def _steering(eyes: list[_EyeOptics]) -> list[Specification]:
    steering = _mean([eye.steering_deg for eye in eyes])
    field = _mean([eye.field_deg for eye in eyes])
    each = f"left {_box(eyes[0].steering_deg, 1)}, right {_box(eyes[1].steering_deg, 1)}"
    return [
        Specification(
            group="Steering",
            name="Actuation range",
            paper="20° × 20°",
            measured=_box(steering, 1),
            note=f"as far as it was calibrated: {each}",
        ),
        Specification(
            group="Steering",
            name="Extended FoV",
            paper="22.9° × 22.2°",
            measured=_box((steering[0] + field[0], steering[1] + field[1]), 1),
            note="actuation range and one fovea's field",
        ),
    ]


def _actuation(eyes: list[_EyeOptics], axes: Sequence[SettleAxisDocument]) -> list[Specification]:
    step_x, step_y = _mean([eye.step_px for eye in eyes])
    settle = _worst(axes, "settle_1pct_ms")
    to_one_px = _worst(axes, "settle_ms")
    response, wide_open = _worst(axes, "response_ms"), _worst(axes, "response_open_ms")
    unmeasured = "run the settle characterisation: foveacam calibrate settle"
    return [
        Specification(
            group="MEMS actuation",
            name="Response time",
            paper="< 1 ms",
            measured=None if response is None else f"{response:.2f} ms",
            note=unmeasured
            if response is None
            else "slowest axis, from the command until half of a step is done, the drive's filter included"
            + ("" if wide_open is None else f"; {wide_open:.2f} ms with the filter wide open"),
        ),
        Specification(
            group="MEMS actuation",
            name="Settle time (worst case)",
            paper="< 2 ms",
            measured=None if settle is None else f"{settle:.1f} ms",
            note=unmeasured
            if settle is None
            else "slowest axis, to 1 % of a step"
            + ("" if to_one_px is None else f"; to one fovea pixel {to_one_px:.1f} ms")
            + "; the drive's low-pass included",
        ),
        Specification(
            group="MEMS actuation",
            name="Step precision",
            paper="~0.08 px/step",
            measured=f"{(step_x + step_y) / 2.0:.3f} px/step",
            note=f"one code of the DAC over the field: {step_x:.3f} px across, {step_y:.3f} px down",
        ),
    ]


def _optics(calibration: Calibration, role: Role) -> _EyeOptics:
    eye = calibration.eye(role)
    plane_from_raw = eye.homography.at(*ahead_rad(eye))
    right, bottom = calibration.fovea_width - 0.5, calibration.fovea_height - 0.5
    x_px, y_px = eye.homography.centre_px
    sides = homography_apply(plane_from_raw, [[-0.5, y_px], [right, y_px], [x_px, -0.5], [x_px, bottom]])
    across, down = (float(np.linalg.norm(sides[k + 1] - sides[k])) for k in (0, 2))
    resolution = px_per_deg(calibration, role)
    step_deg = DAC_STEP_V * _gain_deg_per_v(eye)
    steering = np.rad2deg(np.ptp(eye.mirror.hull_rad, axis=0))
    return _EyeOptics(
        field_deg=(_opening_deg(across, calibration), _opening_deg(down, calibration)),
        steering_deg=(float(steering[0]), float(steering[1])),
        px_per_deg=resolution,
        step_px=(resolution * float(step_deg[0]), resolution * float(step_deg[1])),
    )


def _opening_deg(length_px: float, calibration: Calibration) -> float:
    return 2.0 * math.degrees(math.atan(0.5 * length_px / calibration.fovea_f_px))


def _gain_deg_per_v(eye: EyeCalibration) -> NDArray[np.float64]:
    """Return the (2,) turns of the gaze by one volt of x and of y, mean over the calibrated volts, deg."""
    line = np.linspace(-1.0, 1.0, _GRID)
    volts = np.array([(x, y) for y in line for x in line]) * np.array(eye.mirror.max_v)
    slopes = np.rad2deg(eye.mirror.forward.jacobian(volts))
    gains: NDArray[np.float64] = np.linalg.norm(slopes, axis=1).mean(axis=0)
    return gains


def _worst(axes: Sequence[SettleAxisDocument], name: str) -> float | None:
    values = [value for axis in axes if (value := getattr(axis, name)) is not None]
    return max(values) if values else None


def _mean(pairs: list[tuple[float, float]]) -> tuple[float, float]:
    x, y = np.mean(pairs, axis=0).tolist()
    return x, y


def _box(size_deg: tuple[float, float], digits: int) -> str:
    return f"{size_deg[0]:.{digits}f}° × {size_deg[1]:.{digits}f}°"
