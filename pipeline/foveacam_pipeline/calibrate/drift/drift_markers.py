"""One-shot drift on the calibration's own markers: nodes of a sweep seen once more, against the fitted model.

Markers are measured ten times as well as a scene's texture, and what the wide lens lacks at a node was the
same when the node was swept. So drift of some tenths of a pixel is seen, as in the minutes since a sweep.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.drift.drift import judged
from foveacam_pipeline.calibrate.drift.drift_values import DriftCheck, DriftPlace, DriftSettings
from foveacam_pipeline.calibrate.fit.measured import DistanceSource, NominalRig, PlacedPose, placed_targets
from foveacam_pipeline.calibrate.fit.measured_rows import FitRow, eye_rows
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, SweepPose
from foveacam_pipeline.models.calibration import Calibration, EyeCalibration
from foveacam_pipeline.verge.aim import EYES, aim_at

NODE_SIGMA_PX = 0.06
"""Noise of one node, each axis, fovea px; what the model lacks there comes on top."""
SETTINGS = DriftSettings(
    lens_sigma_wide_px=0.003,
    turn_prior_rad=math.radians(1.0),
    roll_prior_rad=math.radians(0.02),
    stretch_prior=1e-6,
    least_places=4,
    significant=1.0,
    layout=None,
)
"""Heat turns a mount; it neither stretches a mirror's angles nor rolls an eye by much. What exceeds its own
error is taken out: there is no scene here that could mislead."""


def marker_shot(
    sweeps: Sequence[Sweep],
    visits: Sequence[SweepPose],
    calibration: Calibration,
    *,
    distance: DistanceSource,
) -> DriftCheck:
    """Return how far the eyes have moved against a calibration, by nodes of its sweeps visited again.

    `sweeps`: those the calibration was fitted to, the visits among their repeats. Raise InvalidInput when
    the targets cannot be placed. Nothing is changed: `applied` makes a calibration of it.
    """
    placed, _, _ = placed_targets(sweeps, calibration.wide, distance=distance)
    wanted = {(pose.run, pose.index, pose.repeat) for pose in visits}
    seen = [one for one in placed if (one.pose.run, one.pose.index, one.pose.repeat) in wanted]
    places = tuple(place for one in seen if (place := _place(one, calibration, distance)) is not None)
    # the wandering that a calibration states is what is being measured
    still = replace(calibration, left=_still(calibration.left), right=_still(calibration.right))
    found = judged(places, still, settings=SETTINGS, looks=len(visits), duration_s=_duration_s(visits))
    return replace(found, calibration_id=calibration.id)


def _still(eye: EyeCalibration) -> EyeCalibration:
    return replace(eye, mirror=replace(eye.mirror, sigma_rad=(0.0, 0.0)))


def _duration_s(visits: Sequence[SweepPose]) -> float:
    times = [pose.t_ns for pose in visits]
    return 1e-9 * (max(times) - min(times)) if times else 0.0


def _place(placed: PlacedPose, calibration: Calibration, distance: DistanceSource) -> DriftPlace | None:
    """Return the middle of the target as the wide camera and, by the calibration, either eye has it."""
    middle = placed.target.middle_m
    target, inverse = middle[:2] / middle[2], 1.0 / float(middle[2])
    true = aim_at(calibration, target, inverse)
    seen = []
    for role in EYES:
        drawing = NominalRig(rig_id="", baseline_m=calibration.baseline_m, fovea_f_px=calibration.fovea_f_px)
        size = calibration.fovea_width, calibration.fovea_height
        centre_px = np.array([(size[0] - 1) / 2.0, (size[1] - 1) / 2.0])
        rows = eye_rows([placed], role, drawing, distance, centre_px=centre_px)
        if not rows:
            return None
        seen.append(true.eye(role) + _off(rows[0], role, calibration))
    lack = max(max(calibration.eye(role).mirror.loo_rad) for role in EYES)
    sigma = math.hypot(NODE_SIGMA_PX / calibration.fovea_f_px, lack)
    (x, y), (left_x, left_y), (right_x, right_y) = target.tolist(), seen[0].tolist(), seen[1].tolist()
    return DriftPlace(
        target=(x, y),
        left=(left_x, left_y),
        right=(right_x, right_y),
        sigma=(sigma, sigma, sigma),
        score=1.0,
        t_ns=placed.pose.t_ns,
        inverse_depth=inverse,
        inverse_sigma=0.0,
    )


def _off(row: FitRow, role: Role, calibration: Calibration) -> NDArray[np.float64]:
    """Return by how much, (2,) tangents, the model has the image centre beside where it was seen to look."""
    point = calibration.reference_rig_m(role) + row.depth_m * np.array([*np.tan(row.angles_rad), 1.0])
    ray = point - calibration.pivot_rig_m(role)
    modelled = calibration.eye(role).mirror.angles_of(np.array([row.eye.volts_v]))[0]
    return np.asarray(np.tan(modelled) - ray[:2] / ray[2], dtype=np.float64)
