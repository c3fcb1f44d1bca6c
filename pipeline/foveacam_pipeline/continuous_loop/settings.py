"""Settings of the vergence loop, with their bounds and defaults."""

from dataclasses import dataclass, field, fields
from enum import StrEnum

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.track.image_tracker import TrackerKind


class Axis(StrEnum):
    """What the loop corrects, in the order of its arrays."""

    PAN_X = "pan_x"
    PAN_Y = "pan_y"
    VERGE = "verge"
    """The angle between both lines of sight; it tells the depth."""
    SHIFT_Y = "shift_y"
    """Half of what the left eye is steered lower than the right."""


AXES = tuple(Axis)


class GainGroup(StrEnum):
    """The three loops, each with gains of its own; pan has both axes."""

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
"""With a sum of gains of 2 a rig that obeys from one look to the next no longer settles."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Gains:
    """Gains of one loop; kp without unit, ki per unit of loop time, kd in units of loop time.

    A unit of loop time is a millisecond over the sensitivity.
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
    """How the loop sees and corrects."""

    sensitivity: float = 0.1
    """Loop time per ms: scales ki up and kd down."""
    template_scale: float = 1.0 / 3.0
    """Scale at which the foveae are looked for in the wide view: 0 its own, 1 four times that."""
    min_score: float = 0.2
    """Below this correlation in either eye nothing is corrected."""
    correct_for_ms: float | None = None
    """So long after a target was chosen the loop corrects; 0: never, None: always. A tracker suspends it."""
    expand_x: float = 3.0
    expand_y: float = 2.0
    """Width and height of the strip that is searched, in fields of a fovea."""
    pan: Gains = field(default_factory=lambda: Gains(kp=0.1, ki=0.02, kd=0.0))
    depth: Gains = field(default_factory=lambda: Gains(kp=0.2, ki=0.02, kd=0.0))
    vertical: Gains = field(default_factory=lambda: Gains(kp=0.1, ki=0.02, kd=0.0))
    tracker: TrackerKind | None = TrackerKind.TEMPLATE
    """Image tracker of the wide view; None: the target stays where it was chosen."""
    box_width_px: int = 64
    box_height_px: int = 64
    """What the tracker learns, wide px."""
    predict: bool = True
    """Aim at where a tracked target will be in the middle of the exposure."""
    lead_ms: float = 0.0
    """Added to that moment: makes up for a delay that is not measured."""
    most_hz: float | None = None
    """Most looks a second; None: as fast as the rig."""

    def __post_init__(self) -> None:
        """Raise `InvalidInput` for a value out of its bounds."""
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
