"""Check of the light: white paper in the middle of each picture and towards its corners."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from foveacam_hardware.contract import DeviceFault, OutOfRange, Role
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.rig_under_test import EYES, RigUnderTest, both, frame_of, own_marker
from foveacam_pipeline.accept.values import AcceptanceCheck, Fault, Measured, NamedFault, judged

TITLE = "Light: both foveae alike, and to the corners"
CORNERS = ((0.0, 0.0), (-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
CORNER_V = (14.0, 9.0)
"""Drive that moves a marker towards the corner of a fovea, where it is still whole."""
WIDE_CORNER_RAD = (math.radians(9.5), math.radians(7.0))
"""Turn of the rig that moves the markers towards the corner of the wide picture, most of the way."""


@dataclass(slots=True)
class LightSamples:
    """Levels of the white paper in each picture: in its middle, and towards its corners."""

    middle: dict[Role, float] = field(default_factory=dict)
    corners: dict[Role, list[float]] = field(default_factory=dict)


def check_light(
    rig: RigUnderTest, limits: AcceptanceLimits, *, turn: Callable[[float, float], None] | None
) -> tuple[AcceptanceCheck, LightSamples]:
    """Return the brightness of both foveae and all cameras' loss towards their corners, and the levels.

    `turn`: turns the rig beside the markers by (pan, tilt), rad; None where nothing can: then the wide
    camera's loss is not measured.
    """
    samples = LightSamples()
    _sample_foveae(rig, samples)
    note = "the loss of light in the wide picture was not measured: no motor turns the rig"
    if turn is not None:
        note = _sample_wide(rig, samples, turn)
    return _judged_light(samples, limits, note=note), samples


def _sample_foveae(rig: RigUnderTest, samples: LightSamples) -> None:
    for x, y in CORNERS:
        drive = (x * CORNER_V[0], y * CORNER_V[1])
        sighting = rig.look(both(drive, drive))
        for role in EYES:
            level = own_marker(frame_of(sighting, role), rig.layout).white_level
            if x == 0.0:
                samples.middle[role] = level
            else:
                samples.corners.setdefault(role, []).append(level)


def _sample_wide(rig: RigUnderTest, samples: LightSamples, turn: Callable[[float, float], None]) -> str:
    """Look at the marker in the middle of the wide picture and towards its corners; return what failed."""
    try:
        for x, y in CORNERS:
            turn(x * WIDE_CORNER_RAD[0], y * WIDE_CORNER_RAD[1])
            level = own_marker(rig.access.head.wide(max_age_ms=50.0), rig.layout).white_level
            rig.step()
            if x == 0.0:
                samples.middle[Role.WIDE] = level
            else:
                samples.corners.setdefault(Role.WIDE, []).append(level)
    except (DeviceFault, OutOfRange) as error:  # a marker that does not read, a pan-tilt of less reach
        samples.corners.pop(Role.WIDE, None)
        return f"the loss of light in the wide picture was not measured: {error}"
    finally:
        turn(0.0, 0.0)
    return ""


def _judged_light(samples: LightSamples, limits: AcceptanceLimits, *, note: str) -> AcceptanceCheck:
    levels, findings, figures = samples.middle, [], []
    brightest = max(levels[role] for role in EYES)
    for role in EYES:
        level = levels[role]
        share = Measured(
            name=f"{role}: brightness over that of the brighter eye",
            value=round(level / brightest, 3),
            unit="",
            low=limits.eyes_brightness_ratio,
        )
        figures.append(share)
        if not share.is_within:
            detail = (
                f"white paper is {level:.0f} in the {role} fovea and {brightest:.0f} in the other, of 255"
            )
            findings.append(NamedFault(fault=Fault.DARK_EYE, subject=str(role), detail=detail))
    for role, corners in samples.corners.items():
        lost = 1.0 - float(np.mean(corners)) / levels[role]
        figure = Measured(
            name=f"{role}: light lost towards the corners", value=round(lost, 3), unit="", high=limits.falloff
        )
        figures.append(figure)
        if not figure.is_within:
            detail = f"the {role} picture loses {100 * lost:.0f} % of its light towards its corners"
            findings.append(NamedFault(fault=Fault.VIGNETTING, subject=str(role), detail=detail))
    return judged("light", TITLE, figures=figures, findings=findings, note=note, picture="light")
