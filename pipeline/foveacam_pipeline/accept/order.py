"""The checks of an acceptance run in their order: titles, what takes their ground away, what they take."""

from foveacam_pipeline.accept import (
    axes,
    frames,
    geometry,
    light,
    pictures,
    repeatability,
    sensors,
    stopping,
    timing,
    triggers,
)
from foveacam_pipeline.accept.progress import CheckCost
from foveacam_pipeline.accept.values import Fault

DEVICES_TITLE = "Devices: all there"
CLOCK_TITLE = "Clock of the mirrors' controller"
LINES = frozenset({Fault.MISSING_DEVICE, Fault.NO_TRIGGER, Fault.NO_STROBE})
PICTURES = LINES | {Fault.FROZEN_PICTURE}
MARKERS = PICTURES | {
    Fault.MARKER_NOT_SEEN,
    Fault.EXCHANGED_CAMERAS,
    Fault.MIRRORED_PICTURE,
    Fault.ROTATED_PICTURE,
}
STILL = MARKERS | {Fault.LOOSE_MOUNT}
AXES = STILL | {Fault.EXCHANGED_MIRRORS, Fault.EXCHANGED_AXES, Fault.REVERSED_AXIS, Fault.STUCK_AXIS}
RETURNING = AXES | {Fault.SCATTER, Fault.HYSTERESIS}
EXACT = RETURNING | {Fault.MOUNT_DRIFT, Fault.WEAK_DRIVE}
TITLES = {
    "devices": DEVICES_TITLE,
    "triggers": triggers.TITLE,
    "pictures": pictures.TITLE,
    "focus": pictures.FOCUS_TITLE,
    "sensors": sensors.TITLE,
    "rest": repeatability.REST_TITLE,
    "axes": axes.TITLE,
    "light": light.TITLE,
    "frames": frames.TITLE,
    "returns": repeatability.RETURN_TITLE,
    "gains": axes.GAINS_TITLE,
    "timing": timing.TITLE,
    "geometry": geometry.TITLE,
    "stop": stopping.TITLE,
    "clock": CLOCK_TITLE,
}
"""The checks, in their order."""
COSTS = {
    "triggers": CheckCost(steps=1, seconds=3.0),
    "pictures": CheckCost(steps=2, seconds=2.0),
    "sensors": CheckCost(steps=6, seconds=5.0),
    "rest": CheckCost(steps=11, seconds=6.0),
    "axes": CheckCost(steps=8, seconds=2.0),
    "light": CheckCost(steps=10, seconds=7.0),
    "returns": CheckCost(steps=43, seconds=12.0),
    "timing": CheckCost(steps=100, seconds=20.0),
    "geometry": CheckCost(steps=6, seconds=6.0),
    "stop": CheckCost(steps=3, seconds=1.0),
}
"""Of each check that takes time, on a simulated rig in real time; that of the frames is an option."""
LOOK_S = 0.05
"""A look without a pause."""


def short_title(name: str) -> str:
    """Return a check's title without its explanation."""
    return TITLES[name].partition(":")[0]


def costs_of(looks: int, wide_s: float) -> dict[str, CheckCost]:
    """Return what each check takes; `looks`, `wide_s`: options of the check of the frames."""
    seconds = wide_s + LOOK_S * looks
    return COSTS | {"frames": CheckCost(steps=frames.steps(looks, wide_s), seconds=seconds)}
