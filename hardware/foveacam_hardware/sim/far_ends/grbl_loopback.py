"""The pan-tilt's Grbl board in the same process, on the rig's clock; its link is `board_link`'s."""

import threading
from collections.abc import Mapping

from foveacam_hardware.contract import Clock
from foveacam_hardware.sim.far_ends.board_link import BoardLink
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.far_ends.line_faults import Damage
from foveacam_hardware.sim.pan_tilt import PanTiltCables
from foveacam_hardware.wire.link import Link


class GrblLoopback:
    """A simulated Grbl board in this process, with the faults of `grbl_host.GrblProcess`."""

    def __init__(self, clock: Clock, cables: PanTiltCables, *, has_rail: bool = False) -> None:
        self.clock = clock
        self.far_end = GrblFarEnd(clock, cables, has_rail=has_rail)
        self.lock = threading.RLock()

    def open(self) -> Link:
        """Open its port, as a driver's link factory."""
        return BoardLink(self)

    def close(self) -> None:
        """Release nothing: there is no process."""

    def configure(
        self,
        *,
        silent: bool | None = None,
        slow_ns: int | None = None,
        has_switches: bool | None = None,
        settings: Mapping[int, float] | None = None,
    ) -> None:
        """Change how it behaves, or settings by their numbers; what is None stays."""
        far_end = self.far_end
        far_end.firmware.settings.update(settings or {})
        far_end.silent = far_end.silent if silent is None else silent
        far_end.slow_ns = far_end.slow_ns if slow_ns is None else slow_ns
        if has_switches is not None:
            far_end.firmware.has_switches = has_switches

    def damage_to_device(self, damage: Damage) -> None:
        """Damage bytes on their way to the board."""
        self.far_end.to_device.add(damage)

    def damage_to_host(self, damage: Damage) -> None:
        """Damage bytes on their way to the host."""
        self.far_end.to_host.add(damage)

    def hit_a_limit(self) -> None:
        """Let a limit switch trip."""
        with self.lock:
            self.far_end.hit_a_limit()

    def power_cycle(self) -> None:
        """Switch its supply off and on."""
        with self.lock:
            self.far_end.power_cycle()

    def unplug(self) -> None:
        """Pull the cable: it goes dark as well."""
        with self.lock:
            self.far_end.unplug()

    def plug(self) -> None:
        """Put the cable back."""
        with self.lock:
            self.far_end.plug()

    def advance(self, t_ns: int) -> None:
        """Let the board do what was due by `t_ns`, if that has come: the world looks at it."""
        with self.lock:
            self.far_end.advance(min(t_ns, self.clock.now_ns()))
