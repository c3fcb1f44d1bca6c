"""Places whose distance is known otherwise than by the eyes: only they tell the angle between the eyes."""

import math

import numpy as np

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.drift.drift_places import DistinctnessMap, DriftPatch
from foveacam_pipeline.calibrate.drift.drift_values import DriftSettings
from foveacam_pipeline.calibrate.sweep.marker_target import locate_target
from foveacam_pipeline.calibrate.sweep.markers import find_markers
from foveacam_pipeline.models.calibration import Calibration

MIDDLE_PX = 60.0
"""What a told distance is the distance of lies within so many wide px of the middle."""
TOLD_PART = -1
MARKER_PARTS = {Role.WIDE: -2, Role.LEFT: -3, Role.RIGHT: -4}
LENS_REL_SIGMA = 2e-4
"""How well the wide camera's focal length, and so the distance of a target of known size, is known."""


def known_spots(
    field: DistinctnessMap, calibration: Calibration, settings: DriftSettings
) -> list[DriftPatch]:
    """Return the places of a wide picture whose distance is known: of the markers, and as told."""
    return [*_markers(field, calibration, settings), *_told(field, calibration, settings)]


def _markers(field: DistinctnessMap, calibration: Calibration, settings: DriftSettings) -> list[DriftPatch]:
    """Return the markers of the target, if it is in view as it was printed."""
    layout = settings.layout
    if layout is None:
        return []
    views = find_markers(field.gray, side_m=layout.side_m, only=layout.ids)
    try:
        pose = locate_target(views, layout, calibration.wide)
    except InvalidInput:
        return []  # not all there, or other markers of the same numbers: then they tell nothing
    rel_sigma = math.hypot(pose.distance_sigma_m / pose.distance_m, LENS_REL_SIGMA)
    spots = []
    for role in (role for role in Role if layout.id_of(role) in views):
        x_m, y_m, z_m = pose.marker_rig_m(role).tolist()
        pixel = calibration.wide.pixels([[math.atan(x_m / z_m), math.atan(y_m / z_m)]])[0]
        spots.append(
            DriftPatch(
                template=field.patch(calibration.wide, pixel, settings),
                part=MARKER_PARTS[role],
                known_inverse=1.0 / z_m,
                known_sigma=rel_sigma / z_m,
            )
        )
    return spots


def _told(field: DistinctnessMap, calibration: Calibration, settings: DriftSettings) -> list[DriftPatch]:
    """Return the most textured places in the middle of the view, if its distance was told."""
    if settings.distance_m is None:
        return []
    wide = calibration.wide
    middle = np.array([(wide.width - 1) / 2.0, (wide.height - 1) / 2.0])
    (left, top), (right, bottom) = (middle - MIDDLE_PX).tolist(), (middle + MIDDLE_PX).tolist()
    spots = []
    for pixel in field.best((left, top, right, bottom), settings):
        template = field.patch(wide, pixel, settings)
        inverse = math.hypot(1.0, *template.target.tolist()) / settings.distance_m
        spots.append(
            DriftPatch(
                template=template,
                part=TOLD_PART,
                known_inverse=inverse,
                known_sigma=inverse * settings.distance_rel_sigma,
            )
        )
    return spots
