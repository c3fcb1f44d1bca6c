"""Value types of an acceptance run: faults that it can name, results of its checks, and the whole."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum

from foveacam_pipeline.calibrate.settle.settle_values import SettleReport


class Verdict(StrEnum):
    """Result of one check."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_DONE = "not_done"
    """It could not be made; the finding says why."""


class Fault(StrEnum):
    """Causes that a run can name."""

    MISSING_DEVICE = "missing_device"
    NO_TRIGGER = "no_trigger"
    NO_STROBE = "no_strobe"
    LATE_STROBE = "late_strobe"
    LATE_EXPOSURE = "late_exposure"
    FROZEN_PICTURE = "frozen_picture"
    MARKER_NOT_SEEN = "marker_not_seen"
    EXCHANGED_CAMERAS = "exchanged_cameras"
    MIRRORED_PICTURE = "mirrored_picture"
    ROTATED_PICTURE = "rotated_picture"
    DEFOCUS = "defocus"
    EXCHANGED_MIRRORS = "exchanged_mirrors"
    EXCHANGED_AXES = "exchanged_axes"
    REVERSED_AXIS = "reversed_axis"
    STUCK_AXIS = "stuck_axis"
    WEAK_DRIVE = "weak_drive"
    PIXEL_FORMAT = "pixel_format"
    BLACK_LEVEL = "black_level"
    NOISE = "noise"
    HOT_PIXELS = "hot_pixels"
    DARK_EYE = "dark_eye"
    VIGNETTING = "vignetting"
    LOST_FRAMES = "lost_frames"
    FRAME_RATE = "frame_rate"
    SLOW_FILTER = "slow_filter"
    CONTROLLER_CLOCK = "controller_clock"
    LOOSE_MOUNT = "loose_mount"
    MOUNT_DRIFT = "mount_drift"
    HYSTERESIS = "hysteresis"
    SCATTER = "scatter"
    MOVED_EYE = "moved_eye"
    BASELINE = "baseline"
    PRINTED_SCALE = "printed_scale"
    TAPED_DISTANCE = "taped_distance"
    NOT_PARKED = "not_parked"


REMEDIES: dict[Fault, str] = {
    Fault.MISSING_DEVICE: "plug it in, power it, and see foveacam doctor",
    Fault.NO_TRIGGER: "check its trigger cable, and that the camera waits for a rising edge of that line",
    Fault.NO_STROBE: "check its strobe cable, and that the camera puts its exposure on that line",
    Fault.LATE_STROBE: "remove the strobe's delay in the camera's settings, or check its opto-coupler",
    Fault.LATE_EXPOSURE: "remove the camera's trigger delay; if it has none, check its trigger line",
    Fault.FROZEN_PICTURE: "restart the camera; if it repeats its picture again, replace cable or camera",
    Fault.MARKER_NOT_SEEN: "turn the rig until each camera sees its own marker; light and uncover them",
    Fault.EXCHANGED_CAMERAS: "exchange their serial numbers in the rig file, or the cables if it has ports",
    Fault.MIRRORED_PICTURE: "reverse the readout direction in the camera's settings",
    Fault.ROTATED_PICTURE: "turn the camera upright, or reverse both readout directions in its settings",
    Fault.DEFOCUS: "focus the lens on the markers, and lock its ring",
    Fault.EXCHANGED_MIRRORS: "exchange the two mirrors' cables at the controller",
    Fault.EXCHANGED_AXES: "exchange the leads of this mirror's x and y axes",
    Fault.REVERSED_AXIS: "exchange the plus and minus leads of this axis",
    Fault.STUCK_AXIS: "switch the rail off, check this axis's leads, then the mirror itself",
    Fault.WEAK_DRIVE: "check the high-voltage supply and the bias; calibrate again if they are right",
    Fault.PIXEL_FORMAT: "set a pixel format that the camera has, on the page Rig",
    Fault.BLACK_LEVEL: "set the camera's black level back to its default",
    Fault.NOISE: "check the camera's gain, its supply and its temperature",
    Fault.HOT_PIXELS: "let the camera correct its defective pixels, or replace it",
    Fault.DARK_EYE: "open the aperture, clean the lens and its mirror, and compare both eyes' gains",
    Fault.VIGNETTING: "centre the lens on its mirror; something cuts off the rim of the picture",
    Fault.LOST_FRAMES: "check the cable and the bus; lower the frame rate or the packet rate",
    Fault.FRAME_RATE: "shorten the exposure or set a rate that exposure and readout allow",
    Fault.SLOW_FILTER: "check the controller's filter clock, or state the real cut-off in the rig file",
    Fault.CONTROLLER_CLOCK: "the controller's oscillator is off; exposure times are wrong by as much",
    Fault.LOOSE_MOUNT: "tighten the mount of this eye, its mirror and its camera, and calibrate again",
    Fault.MOUNT_DRIFT: "let the rig warm up for an hour; then look for a part that creeps",
    Fault.HYSTERESIS: "approach every gaze from the same side, or replace the mirrors",
    Fault.SCATTER: "the mirrors do not return to the same angle; check the drive, then the mirrors",
    Fault.MOVED_EYE: "tighten what has moved of this eye's mounts; then run foveacam calibrate all",
    Fault.BASELINE: "tighten the mount that has moved; then run foveacam calibrate all",
    Fault.PRINTED_SCALE: "measure the printed markers; print at 100 %, or state their size in the rig file",
    Fault.TAPED_DISTANCE: "measure the distance to the markers again, from the wide camera's front lens",
    Fault.NOT_PARKED: "do not use the rig: a stop must bring the mirrors to rest",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedFault:
    """A fault that was named. `subject`: what has it, such as "left" or "left x"; empty for the rig."""

    fault: Fault
    subject: str
    detail: str

    @property
    def remedy(self) -> str:
        """What to do about it."""
        return REMEDIES[self.fault]


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """One figure beside its limits; a limit of None does not exist."""

    name: str
    value: float
    unit: str
    low: float | None = None
    high: float | None = None

    @property
    def is_within(self) -> bool:
        """Whether the figure keeps its limits."""
        above = self.low is None or self.value >= self.low
        return above and (self.high is None or self.value <= self.high)


@dataclass(frozen=True, slots=True, kw_only=True)
class AcceptanceCheck:
    """Result of one check. `picture`: name of the picture that shows it, None without one."""

    name: str
    title: str
    verdict: Verdict
    figures: tuple[Measured, ...] = ()
    findings: tuple[NamedFault, ...] = ()
    note: str = ""
    picture: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Acceptance:
    """A whole run, or the part of one that was made before it was cancelled."""

    rig_id: str
    calibration_id: str | None
    begun_utc: str
    duration_s: float
    complete: bool
    checks: tuple[AcceptanceCheck, ...]
    pictures: dict[str, bytes] = field(default_factory=dict)
    """PNG by name."""
    settling: SettleReport | None = None
    """How the mirrors settle; None where it was not measured."""

    @property
    def findings(self) -> tuple[NamedFault, ...]:
        """All faults, in the order of the checks."""
        return tuple(found for check in self.checks for found in check.findings)

    @property
    def accepted(self) -> bool:
        """Whether every check was made and passed."""
        return self.complete and all(check.verdict is Verdict.PASSED for check in self.checks)


def not_done(name: str, title: str, why: str) -> AcceptanceCheck:
    """Return the result of a check that could not be made."""
    return AcceptanceCheck(name=name, title=title, verdict=Verdict.NOT_DONE, note=why)


def judged(
    name: str,
    title: str,
    *,
    figures: Iterable[Measured] = (),
    findings: Iterable[NamedFault] = (),
    note: str = "",
    picture: str | None = None,
) -> AcceptanceCheck:
    """Return the result of a check that was made: failed where it found something."""
    found = tuple(findings)
    return AcceptanceCheck(
        name=name,
        title=title,
        verdict=Verdict.FAILED if found else Verdict.PASSED,
        figures=tuple(figures),
        findings=found,
        note=note,
        picture=picture,
    )
