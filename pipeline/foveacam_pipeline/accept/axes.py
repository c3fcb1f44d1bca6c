"""Check of the mirrors' axes: small steps of each, and the motion of both pictures that they cause."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, Role, StereoVolts
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.rig_under_test import (
    EYES,
    RigUnderTest,
    both,
    marker_px,
    other_eye,
)
from foveacam_pipeline.accept.values import AcceptanceCheck, Fault, Measured, NamedFault, judged
from foveacam_pipeline.calibrate.fit.measured_rows import NominalRig
from foveacam_pipeline.models.calibration import Calibration

TITLE = "Mirrors: each axis and its direction"
GAINS_TITLE = "Mirrors: gain of each axis"
STEP_V = 8.0
"""Half a degree: the marker stays in view."""
NOMINAL_GAIN_DEG_PER_V = (0.060, 0.052)
FOCAL_PX = NominalRig(rig_id="").fovea_f_px
"""Of a fovea whose calibration does not matter, or is missing."""
STUCK_SHARE = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisResponse:
    """Motion of both gazes, deg per volt (4, 4): rows left x, left y, right x, right y; columns alike."""

    gains_deg_per_v: NDArray[np.float64]

    def block(self, moved: Role, driven: Role) -> NDArray[np.float64]:
        """Return the gains (2, 2) of one eye's gaze by one mirror's volts, deg/V."""
        rows, columns = _slice(moved), _slice(driven)
        return self.gains_deg_per_v[rows, columns]


def check_axes(rig: RigUnderTest, calibration: Calibration | None) -> tuple[AcceptanceCheck, AxisResponse]:
    """Return the result of stepping all four axes, one at a time, and how the gazes followed."""
    response = _measured_response(rig, calibration)
    return judged("axes", TITLE, findings=findings_of(response), picture="axes"), response


def check_gains(
    response: AxisResponse, limits: AcceptanceLimits, calibration: Calibration | None
) -> AcceptanceCheck:
    """Return the gains of the axes against the calibrated ones, or the nominal ones without a calibration."""
    allowed = limits.gain_rel_nominal if calibration is None else limits.gain_rel
    figures, off = [], {}
    for role in EYES:
        ratios = np.diag(response.block(role, role)) / _expected_deg_per_v(calibration, role)
        figures += [
            Measured(
                name=f"{role} {name}: gain over the expected one",
                value=round(float(ratio), 4),
                unit="",
                low=1.0 - allowed,
                high=1.0 + allowed,
            )
            for name, ratio in zip("xy", ratios, strict=True)
        ]
        if float(np.abs(ratios - 1.0).max()) > allowed:
            off[str(role)] = f"{role} {ratios[0]:.3f} (x) and {ratios[1]:.3f} (y)"
    findings = []
    if off:
        source = "nominal" if calibration is None else "calibrated"
        detail = f"gain of the mirrors against the {source} one: {'; '.join(off.values())}"
        findings = [NamedFault(fault=Fault.WEAK_DRIVE, subject=" and ".join(off), detail=detail)]
    return judged("gains", GAINS_TITLE, figures=figures, findings=findings)


def _measured_response(rig: RigUnderTest, calibration: Calibration | None) -> AxisResponse:
    focal_px = FOCAL_PX if calibration is None else calibration.fovea_f_px
    columns = []
    for axis in range(4):
        after, before = (_places_px(rig, _one_axis(axis, sign * STEP_V)) for sign in (1.0, -1.0))
        columns.append(np.rad2deg(-(after - before) / (2.0 * STEP_V * focal_px)))
    return AxisResponse(gains_deg_per_v=np.column_stack(columns))


def _places_px(rig: RigUnderTest, volts: StereoVolts) -> NDArray[np.float64]:
    """Return the places (4,) of each eye's marker: left x, left y, right x, right y, px."""
    sighting = rig.look(volts)
    return np.concatenate([marker_px(rig, sighting, role) for role in EYES])


def _one_axis(axis: int, volts_v: float) -> StereoVolts:
    drive = [0.0] * 4
    drive[axis] = volts_v
    return both((drive[0], drive[1]), (drive[2], drive[3]))


def findings_of(response: AxisResponse) -> list[NamedFault]:
    """Return what is wrong with the axes' wiring."""
    own = sum(float(np.abs(response.block(role, role)).sum()) for role in EYES)
    other = sum(float(np.abs(response.block(role, other_eye(role))).sum()) for role in EYES)
    if other > own:
        detail = "volts for the left mirror move the right picture, and the other way round"
        return [NamedFault(fault=Fault.EXCHANGED_MIRRORS, subject="left and right", detail=detail)]
    return [found for role in EYES for found in _structural(response.block(role, role), role)]


def _structural(gains: NDArray[np.float64], role: Role) -> list[NamedFault]:
    """Return what is wrong with the axes of one mirror, of its gains (2, 2), deg/V."""
    nominal = np.array(NOMINAL_GAIN_DEG_PER_V)
    moved = np.linalg.norm(gains, axis=0)
    found = [
        NamedFault(
            fault=Fault.STUCK_AXIS,
            subject=f"{role} {name}",
            detail=f"{STEP_V:g} V on the {role} mirror's {name} axis move its picture by "
            f"{100.0 * moved[axis] / nominal[axis]:.0f} % of what they should",
        )
        for axis, name in enumerate("xy")
        if not moved[axis] > STUCK_SHARE * nominal[axis]
    ]
    if found:
        return found
    if abs(gains[1, 0]) > abs(gains[0, 0]) and abs(gains[0, 1]) > abs(gains[1, 1]):
        detail = f"volts for x of the {role} mirror move its picture along y, and the other way round"
        return [NamedFault(fault=Fault.EXCHANGED_AXES, subject=str(role), detail=detail)]
    return [
        NamedFault(
            fault=Fault.REVERSED_AXIS,
            subject=f"{role} {name}",
            detail=f"volts on the {role} mirror's {name} axis turn its gaze the wrong way",
        )
        for axis, name in enumerate("xy")
        if gains[axis, axis] < 0.0
    ]


def _expected_deg_per_v(calibration: Calibration | None, role: Role) -> NDArray[np.float64]:
    if calibration is None:
        return np.array(NOMINAL_GAIN_DEG_PER_V)
    mirror = calibration.eye(role).mirror
    slopes = []
    for axis in range(2):
        step = STEP_V * np.eye(2)[axis]
        after, before = (
            np.array(mirror.angles_rad(MirrorVolts(x_v=float(sign * step[0]), y_v=float(sign * step[1]))))
            for sign in (1.0, -1.0)
        )
        slopes.append((after - before)[axis] / (2.0 * STEP_V))
    return np.asarray(np.rad2deg(np.array(slopes)), dtype=np.float64)


def _slice(role: Role) -> slice:
    return slice(0, 2) if role is Role.LEFT else slice(2, 4)
