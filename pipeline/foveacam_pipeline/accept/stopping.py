"""Check of the stop: from the call to mirrors at rest, as the controller and the pictures show it."""

import numpy as np

from foveacam_hardware.contract import PARKED, DeviceFault, FoveaError, LookOptions, Sighting
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.rig_under_test import EYES, REST_US, RigUnderTest, both, marker_px
from foveacam_pipeline.accept.values import AcceptanceCheck, Fault, Measured, NamedFault, judged
from foveacam_pipeline.capture.run.access import CaptureRig

TITLE = "Stop: from the call to mirrors at rest"
AWAY_V = 50.0
CONFIRMED_S = 1.0


def check_stop(rig: RigUnderTest, limits: AcceptanceLimits, *, spread_px: float) -> AcceptanceCheck:
    """Return how soon parked mirrors are confirmed, and whether the pictures show them at rest.

    `spread_px`: by how much two returns of these mirrors differ anyhow.
    """
    home = rig.look()
    for role in EYES:
        marker_px(rig, home, role)  # raises where the markers are not in view to begin with
    rig.look(both((AWAY_V, AWAY_V), (AWAY_V, AWAY_V)))
    began_ns = rig.clock.now_ns()
    fault = rig.on_device(_parked)
    took_ms = (rig.clock.now_ns() - began_ns) / 1e6
    findings = []
    if fault is not None:
        findings.append(NamedFault(fault=Fault.NOT_PARKED, subject="", detail=f"the controller: {fault}"))
    rig.wait(1e-6 * REST_US)
    after = rig.look(PARKED, options=LookOptions(settle_us=0))
    off_px = _off_rest_px(rig, home, after)
    figures = [
        Measured(name="stop to confirmation", value=round(took_ms, 2), unit="ms", high=limits.park_ms),
        Measured(
            name="pictures away from rest",
            value=round(off_px, 2),
            unit="px",
            high=round(limits.parked_px + spread_px, 1),
        ),
    ]
    findings += [
        NamedFault(fault=Fault.NOT_PARKED, subject="", detail=f"{each.name}: {each.value:g} {each.unit}")
        for each in figures
        if not each.is_within and not findings
    ]
    return judged("stop", TITLE, figures=figures, findings=findings)


def _off_rest_px(rig: RigUnderTest, home: Sighting, after: Sighting) -> float:
    """Return how far the markers are from where they are at rest, px; the picture's width without them."""
    try:
        return max(
            float(np.linalg.norm(marker_px(rig, after, role) - marker_px(rig, home, role))) for role in EYES
        )
    except DeviceFault:  # a marker that was in view at rest has left it
        return float(after.left.binning * after.left.image.shape[1])


def _parked(rig: CaptureRig) -> str | None:
    """Park and wait for the confirmation; return why it did not come, None when it did."""
    try:
        rig.mirrors.park_confirmed(within_s=CONFIRMED_S)
    except FoveaError as error:
        return str(error)
    return None
