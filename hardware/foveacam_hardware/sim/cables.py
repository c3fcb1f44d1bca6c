"""What the controller's pins drive, and what the cameras answer: the border between far end and world.

The far end calls it; the world implements it. Times are on the rig's clock.
"""

from dataclasses import dataclass, field
from typing import Protocol

from foveacam_hardware.contract import Role

CAMERA_CENTRE = 1
CAMERA_LEFT = 2
CAMERA_RIGHT = 4
"""Bits of a camera mask, as the controller's protocol numbers them."""

CAMERA_ROLES = {CAMERA_CENTRE: Role.WIDE, CAMERA_LEFT: Role.LEFT, CAMERA_RIGHT: Role.RIGHT}

TRIGGER_TO_EXPOSURE_US = 150
"""From the rise of a trigger line until the camera exposes and its strobe rises: 149 to 159 µs were measured
with the real firmware."""

DacCodes = tuple[int, ...]
"""8 DAC codes: left x+, x−, y+, y−, then right x+, x−, y+, y−."""
NO_CODES: DacCodes = (0,) * 8
"""Of DACs without a supply, or before the first write."""


class Cables(Protocol):
    """The wires between the controller and the rest of the rig.

    Calls come in the order of their times, but a little after them: an implementation keeps
    histories and never asks its own clock "now".
    """

    def drive(self, t_ns: int, codes: DacCodes) -> None:
        """Take the 8 DAC codes (left x+, x−, y+, y−, right x+, x−, y+, y−) in force from `t_ns` on."""
        ...

    def rail(self, t_ns: int, *, on: bool) -> None:
        """Take the state of the mirrors' high-voltage rail."""
        ...

    def low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        """Take the cutoff of the drive filters; 0 while the filter clock stands still."""
        ...

    def trigger(self, t_ns: int, *, pulse_us: int, cameras: int) -> None:
        """Take a rising edge of the trigger lines in the mask `cameras` (1 centre, 2 left, 4 right)."""
        ...

    def strobe_us(self, role: Role) -> int | None:
        """Return the exposure that a camera's strobe line shows for a trigger now; None = no strobe."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class TriggerEdge:
    """One rising edge of the trigger lines."""

    t_ns: int
    pulse_us: int
    cameras: int


@dataclass(slots=True)
class RecordingCables:
    """Cables that lead nowhere: they remember what the controller did, and strobe as they are told."""

    exposure_us: dict[Role, int | None] = field(
        default_factory=lambda: {Role.LEFT: 5000, Role.RIGHT: 5000, Role.WIDE: None}
    )
    drives: list[tuple[int, DacCodes]] = field(default_factory=list)
    rails: list[tuple[int, bool]] = field(default_factory=list)
    cutoffs: list[tuple[int, int]] = field(default_factory=list)
    triggers: list[TriggerEdge] = field(default_factory=list)

    @property
    def codes(self) -> DacCodes:
        """The DAC codes now in force (zeros before the first write)."""
        return self.drives[-1][1] if self.drives else NO_CODES

    @property
    def rail_on(self) -> bool:
        """Whether the mirrors' rail is on."""
        return bool(self.rails) and self.rails[-1][1]

    @property
    def cutoff_hz(self) -> int:
        """The drive filters' cutoff; 0 while their clock stands still."""
        return self.cutoffs[-1][1] if self.cutoffs else 0

    def drive(self, t_ns: int, codes: DacCodes) -> None:
        """Remember the codes."""
        self.drives.append((t_ns, codes))

    def rail(self, t_ns: int, *, on: bool) -> None:
        """Remember the rail."""
        self.rails.append((t_ns, on))

    def low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        """Remember the cutoff."""
        self.cutoffs.append((t_ns, cutoff_hz))

    def trigger(self, t_ns: int, *, pulse_us: int, cameras: int) -> None:
        """Remember the edge."""
        self.triggers.append(TriggerEdge(t_ns=t_ns, pulse_us=pulse_us, cameras=cameras))

    def strobe_us(self, role: Role) -> int | None:
        """Return the exposure set for `role`."""
        return self.exposure_us.get(role)


class ShutterPort(Protocol):
    """What a camera's trigger input and strobe output look like to the world."""

    def trigger(self, t_ns: int) -> None:
        """Take a rising edge of the trigger line."""
        ...

    def strobe_us(self) -> int | None:
        """Return the exposure that a trigger now would start; None when it would start none."""
        ...
