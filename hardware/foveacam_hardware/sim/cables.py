"""The signals between the mirror controller, the mirrors and the cameras.

The controller's far end calls `Cables`; the world implements it. Times are on the rig's clock.
"""

from dataclasses import dataclass, field
from typing import Protocol

from foveacam_hardware.contract import Role

CAMERA_CENTRE = 1
CAMERA_LEFT = 2
CAMERA_RIGHT = 4
"""Bits of a camera mask in the controller's protocol."""

CAMERA_ROLES = {CAMERA_CENTRE: Role.WIDE, CAMERA_LEFT: Role.LEFT, CAMERA_RIGHT: Role.RIGHT}

TRIGGER_TO_EXPOSURE_US = 150
"""Delay from the rise of a trigger line to the exposure and the rise of its strobe; measured with the real
firmware: 149 to 159 µs."""

DacCodes = tuple[int, ...]
"""8 DAC codes: left x+, x−, y+, y−, then right x+, x−, y+, y−."""
NO_CODES: DacCodes = (0,) * 8
"""Codes of DACs without a supply, or before the first write."""


class Cables(Protocol):
    """The wires between the controller and the rest of the rig.

    Calls arrive in the order of their times, but somewhat later: an implementation keeps histories
    and never reads its own clock.
    """

    def set_codes(self, t_ns: int, codes: DacCodes) -> None:
        """Set the 8 DAC codes (left x+, x−, y+, y−, right x+, x−, y+, y−) from `t_ns` on."""
        ...

    def set_rail(self, t_ns: int, *, on: bool) -> None:
        """Switch the mirrors' high-voltage rail."""
        ...

    def set_low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        """Set the cutoff of the drive filters; 0 stops the filter clock."""
        ...

    def trigger(self, t_ns: int, *, pulse_us: int, cameras: int) -> None:
        """Raise the trigger lines in the mask `cameras` (1 centre, 2 left, 4 right)."""
        ...

    def strobe_us(self, role: Role) -> int | None:
        """Return the length of the strobe pulse that a trigger now would cause; None without a strobe."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class TriggerEdge:
    """One rising edge of the trigger lines."""

    t_ns: int
    pulse_us: int
    cameras: int


@dataclass(slots=True)
class RecordingCables:
    """Cables that record what the controller does, and answer with the strobes in `exposure_us`."""

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
        """Whether the mirrors' high-voltage rail is on."""
        return bool(self.rails) and self.rails[-1][1]

    @property
    def cutoff_hz(self) -> int:
        """The drive filters' cutoff; 0 while their clock is stopped."""
        return self.cutoffs[-1][1] if self.cutoffs else 0

    def set_codes(self, t_ns: int, codes: DacCodes) -> None:
        """Record the codes."""
        self.drives.append((t_ns, codes))

    def set_rail(self, t_ns: int, *, on: bool) -> None:
        """Record the state of the rail."""
        self.rails.append((t_ns, on))

    def set_low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        """Record the cutoff."""
        self.cutoffs.append((t_ns, cutoff_hz))

    def trigger(self, t_ns: int, *, pulse_us: int, cameras: int) -> None:
        """Record the edge."""
        self.triggers.append(TriggerEdge(t_ns=t_ns, pulse_us=pulse_us, cameras=cameras))

    def strobe_us(self, role: Role) -> int | None:
        """Return the exposure set for `role`."""
        return self.exposure_us.get(role)


class ShutterPort(Protocol):
    """A camera's trigger input and strobe output."""

    def trigger(self, t_ns: int) -> None:
        """Receive a rising edge of the trigger line."""
        ...

    def strobe_us(self) -> int | None:
        """Return the exposure that a trigger now would start; None when it would not start one."""
        ...
