"""Test of both mirrors straight ahead before a sweep: response on both axes, and sufficient reach."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import DeviceFault, OutOfRange, Role
from foveacam_pipeline.calibrate.sweep.eye_prediction import clamp_volts, degrees
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose
from foveacam_pipeline.calibrate.sweep.sweep_plan import SweepPlan
from foveacam_pipeline.calibrate.sweep.sweep_pose import EYES, PoseMeter
from foveacam_pipeline.calibrate.sweep.sweep_settings import SweepSettings
from foveacam_pipeline.calibrate.sweep.sweep_wide import WideMarkersAtRest

AXES = ("x", "y")
OVERHANG_RAD = math.radians(1.0)
"""Maximum distance from an eye's middle at which its marker is whole in view and counts as a rim pose."""


def probe_mirrors(meter: PoseMeter, settings: SweepSettings) -> WideMarkersAtRest:
    """Find both markers straight ahead and test every axis; raise DeviceFault naming one without response.

    Raise InvalidInput when the target is wrong: swapped markers, another layout, a wrong tape. An eye whose
    marker is not found is not tested; the sweep refuses it pose by pose.
    """
    at_rest = meter.look_wide()
    target = meter.locate(at_rest)
    eyes, _ = meter.aim_eyes(at_rest)
    meter.centre_eyes(
        eyes,
        at_rest,
        target,
        enough=lambda: all(eye.done or meter.predictions[role].count > 0 for role, eye in eyes.items()),
    )
    found = [role for role in EYES if meter.predictions[role].count > 0]
    start_v = {role: eyes[role].command_v for role in EYES}
    gazes = _gazes(meter, start_v, at_rest, target)
    for axis in (0, 1):
        step_v = settings.probe_v * np.eye(2)[axis]
        tried_v = {role: clamp_volts(start_v[role] + step_v, settings.max_v) for role in EYES}
        answers = _gazes(meter, tried_v, at_rest, target)
        for role in found:
            before, after = gazes[role], answers[role]
            if before is not None and after is not None:
                _check_response(role, axis, after - before, settings)
    return at_rest


def check_volts(meter: PoseMeter, plan: SweepPlan, settings: SweepSettings) -> None:
    """Raise OutOfRange when a mirror cannot reach the plan by its gain at the middle."""
    for role in EYES:
        if meter.predictions[role].count < 3:
            continue
        for axis, half_rad in enumerate((plan.half_width_rad, plan.half_height_rad)):
            reach_rad = meter.predictions[role].reach_rad(axis, settings.max_v)
            if half_rad > reach_rad + OVERHANG_RAD:
                raise OutOfRange(
                    f"sweep to ±{degrees(half_rad)} along {AXES[axis]}: with ±{settings.max_v:g} V the "
                    f"{role} mirror reaches ±{degrees(reach_rad)} at most; choose a smaller sweep"
                )


def _gazes(
    meter: PoseMeter,
    commands_v: dict[Role, NDArray[np.float64]],
    at_rest: WideMarkersAtRest,
    target: TargetPose,
) -> dict[Role, NDArray[np.float64] | None]:
    sighting = meter.look(commands_v)
    at_rest.add(sighting.wide)
    gazes = {}
    for role in EYES:
        observation = meter.observe(sighting, role)
        gaze = meter.find_gaze(observation, at_rest, target)
        gazes[role] = gaze
        if gaze is not None and (observation.view is not None or observation.others):
            meter.predictions[role].learn(gaze, observation.volts_v)
    return gazes


def _check_response(role: Role, axis: int, turned_rad: NDArray[np.float64], settings: SweepSettings) -> None:
    expected_rad = settings.probe_v * settings.rad_per_v[axis]
    found_rad = float(np.linalg.norm(turned_rad))
    if found_rad < settings.least_response * expected_rad:
        raise DeviceFault(
            f"{role} mirror, {AXES[axis]} axis: {settings.probe_v:g} V more should turn the gaze by "
            f"{degrees(expected_rad)}, it turned by {degrees(found_rad)}: the axis does not answer; "
            "check the mirror, its cable and its driver, and that its camera delivers new pictures"
        )
