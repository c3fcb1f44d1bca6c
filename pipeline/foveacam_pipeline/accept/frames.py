"""Check of the frames' rate and losses: the wide camera at its own rate, the foveae by pulse after pulse."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import CameraCounters, Frame, LookOptions, Role
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.rig_under_test import EYES, RigUnderTest, camera_of
from foveacam_pipeline.accept.values import AcceptanceCheck, Fault, Measured, NamedFault, judged

TITLE = "Frames: rate and losses"
AT_ONCE = LookOptions(settle_us=0)
USUAL_RATE_HZ = 30.0
READ_AT_ONCE = 15
"""Frames that are read in one piece of work, between which a stop or a cancel is noticed."""


def steps(looks: int, wide_s: float) -> int:
    """Return about how many steps the check takes."""
    return looks + max(1, round(wide_s * USUAL_RATE_HZ / READ_AT_ONCE))


def check_frames(
    rig: RigUnderTest, limits: AcceptanceLimits, *, looks: int, wide_s: float
) -> tuple[AcceptanceCheck, NDArray[np.int64]]:
    """Return the result of `looks` looks without a pause and of `wide_s` seconds of the wide camera.

    Also return number and time (n, 2), ns, of the wide frames.
    """
    before = _counters(rig)
    counted = rig.counts.looks, dict(rig.counts.missing)
    for _ in range(looks):
        rig.look(options=AT_ONCE)
    wide = _wide_frames(rig, wide_s)
    after = _counters(rig)
    tried = rig.counts.looks - counted[0]
    figures, findings = [], []
    for role in Role:
        lost = _lost(after[role]) - _lost(before[role])
        if role in EYES:
            lost = max(lost, rig.counts.missing[role] - counted[1][role])
        share = lost / max(
            lost + (tried if role in EYES else after[role].delivered - before[role].delivered), 1
        )
        figures.append(
            Measured(name=f"{role}: frames lost", value=round(share, 5), unit="", high=limits.lost_fraction)
        )
        if share > limits.lost_fraction:
            detail = f"{lost} frames of the {role} camera never came, {100.0 * share:.1f} % of them"
            findings.append(NamedFault(fault=Fault.LOST_FRAMES, subject=str(role), detail=detail))
    rate = _rate(rig, wide, limits)
    figures.append(rate)
    if not rate.is_within:
        detail = f"the wide camera delivers {rate.value:.2f} of the frames that are set"
        findings.append(NamedFault(fault=Fault.FRAME_RATE, subject="wide", detail=detail))
    result = judged("frames", TITLE, figures=figures, findings=findings, picture="frames")
    return result, np.array(wide, dtype=np.int64)


def _rate(rig: RigUnderTest, wide: list[tuple[int, int]], limits: AcceptanceLimits) -> Measured:
    """Return the wide camera's rate against the one that is set, by its frames' numbers and times."""
    set_hz = rig.settings()[Role.WIDE].frame_rate_hz
    numbers, times_ns = np.array(wide, dtype=np.int64).T
    period_ns = float(np.median(np.diff(times_ns) / np.diff(numbers)))
    return Measured(
        name="wide: rate against the set one",
        value=round(1e9 / period_ns / set_hz, 4),
        unit="",
        low=1.0 - limits.rate_rel,
        high=1.0 + limits.rate_rel,
    )


def _wide_frames(rig: RigUnderTest, seconds: float) -> list[tuple[int, int]]:
    """Return number and time of every wide frame of some seconds."""
    until_ns = rig.clock.now_ns() + round(seconds * 1e9)
    found: list[tuple[int, int]] = []
    while rig.clock.now_ns() < until_ns or len(found) < READ_AT_ONCE:
        frames: list[Frame] = rig.on_device(lambda devices: list(devices.wide.frames(READ_AT_ONCE)))
        found += [(frame.seq, frame.t_ns) for frame in frames]
        rig.step()
    return found


def _counters(rig: RigUnderTest) -> dict[Role, CameraCounters]:
    return rig.on_device(lambda devices: {role: camera_of(devices, role).counters for role in Role})


def _lost(counters: CameraCounters) -> int:
    return counters.dropped + counters.incomplete + counters.late + counters.underrun
