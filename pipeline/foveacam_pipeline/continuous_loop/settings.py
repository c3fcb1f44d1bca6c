"""Settings of the vergence loop, with their bounds and defaults."""

from dataclasses import dataclass, field, fields
from enum import StrEnum

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.track.image_tracker import TrackerKind


class Axis(StrEnum):
    """Controlled variables of the loop, in the order of its arrays."""

    PAN_X = "pan_x"
    PAN_Y = "pan_y"
    VERGE = "verge"
    """Vergence: the angle between both lines of sight; it determines the depth."""
    SHIFT_Y = "shift_y"
    """Vertical shift: half the angle by which the left eye points lower than the right."""


AXES = tuple(Axis)


class GainGroup(StrEnum):
    """The three loops with separate gains; that of pan controls two axes."""

    PAN = "pan"
    DEPTH = "depth"
    VERTICAL = "vertical"


GROUP_OF = {
    Axis.PAN_X: GainGroup.PAN,
    Axis.PAN_Y: GainGroup.PAN,
    Axis.VERGE: GainGroup.DEPTH,
    Axis.SHIFT_Y: GainGroup.VERTICAL,
}
MOST_GAIN = 2.0
"""Stability limit: with a total gain of 2 a rig that follows within one look oscillates without decay."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Gains:
    """PID gains of one loop: kp without unit, ki per unit of loop time, kd in units of loop time.

    A unit of loop time is a millisecond divided by the sensitivity.
    """

    kp: float
    ki: float
    kd: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """Least and largest value of a setting."""

    least: float
    most: float


BOUNDS = {
    "sensitivity": Bounds(least=0.01, most=1.0),
    "template_scale": Bounds(least=0.0, most=1.0),
    "min_score": Bounds(least=0.0, most=1.0),
    "correct_for_ms": Bounds(least=0.0, most=10_000.0),
    "expand_x": Bounds(least=1.0, most=4.0),
    "expand_y": Bounds(least=1.0, most=4.0),
    "box_width_px": Bounds(least=16, most=400),
    "box_height_px": Bounds(least=16, most=400),
    "lead_ms": Bounds(least=-50.0, most=50.0),
    "most_hz": Bounds(least=0.5, most=1000.0),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopSettings:
    """Settings of matching, control, target tracking and rate."""

    sensitivity: float = 0.1
    """Loop time per ms: scales ki up and kd down."""
    template_scale: float = 1.0 / 3.0
    """Scale at which the foveae are matched in the wide view: 0 its native scale, 1 four times that."""
    min_score: float = 0.2
    """Least correlation of both eyes for a correction."""
    correct_for_ms: float | None = None
    """Time after the choice of a target during which the loop corrects; 0: never, None: always.

    It does not apply while a tracker follows the target.
    """
    expand_x: float = 3.0
    expand_y: float = 2.0
    """Width and height of the guide strip, in fields of a fovea."""
    pan: Gains = field(default_factory=lambda: Gains(kp=0.1, ki=0.02, kd=0.0))
    depth: Gains = field(default_factory=lambda: Gains(kp=0.2, ki=0.02, kd=0.0))
    vertical: Gains = field(default_factory=lambda: Gains(kp=0.1, ki=0.02, kd=0.0))
    tracker: TrackerKind | None = TrackerKind.TEMPLATE
    """Image tracker of the wide view; None: the target stays where it was chosen."""
    box_width_px: int = 64
    box_height_px: int = 64
    """Size of the tracker's template, wide px."""
    predict: bool = True
    """Aim at the predicted position of a tracked target at mid-exposure."""
    lead_ms: float = 0.0
    """Added to the time of the prediction, to compensate a delay that is not measured."""
    most_hz: float | None = None
    """Upper limit of the look rate; None: as fast as the rig."""

    def __post_init__(self) -> None:
        """Raise `InvalidInput` for a value outside its bounds."""
        for name, bounds in BOUNDS.items():
            value = getattr(self, name)
            if value is not None and not bounds.least <= value <= bounds.most:
                raise InvalidInput(f"{name}: asked {value:g}, choose {bounds.least:g} to {bounds.most:g}")
        for group in GainGroup:
            for one in fields(Gains):
                value = getattr(self.gains(group), one.name)
                if not 0.0 <= value <= MOST_GAIN:
                    raise InvalidInput(f"{group}.{one.name}: asked {value:g}, choose 0 to {MOST_GAIN:g}")

    def gains(self, group: GainGroup) -> Gains:
        """Return the gains of a loop."""
        return {GainGroup.PAN: self.pan, GainGroup.DEPTH: self.depth, GainGroup.VERTICAL: self.vertical}[
            group
        ]
