"""A FLIR pan-tilt unit in the same process, on the rig's clock; its link is `board_link`'s."""

import threading

from foveacam_hardware.contract import Clock
from foveacam_hardware.sim.far_ends.board_link import BoardLink
from foveacam_hardware.sim.far_ends.line_faults import Damage
from foveacam_hardware.sim.far_ends.ptu_far_end import PtuFarEnd
from foveacam_hardware.sim.pan_tilt import PanTiltCables
from foveacam_hardware.wire.link import Link


class PtuLoopback:
    """A simulated unit in this process, with the faults of `ptu_host.PtuProcess`."""

    def __init__(self, clock: Clock, cables: PanTiltCables) -> None:
        self.clock = clock
        self.far_end = PtuFarEnd(clock, cables)
        self.lock = threading.RLock()

    def open(self) -> Link:
        """Open its port, as a driver's link factory."""
        return BoardLink(self)

    def configure(
        self,
        *,
        silent: bool | None = None,
        slow_ns: int | None = None,
        seized: bool | None = None,
        steps_per_s: int | None = None,
    ) -> None:
        """Change how it behaves, or how fast it can turn; what is None stays."""
        far_end = self.far_end
        far_end.silent = far_end.silent if silent is None else silent
        far_end.slow_ns = far_end.slow_ns if slow_ns is None else slow_ns
        far_end.firmware.seized = far_end.firmware.seized if seized is None else seized
        if steps_per_s is not None:
            far_end.firmware.hurry(steps_per_s)

    def damage_to_device(self, damage: Damage) -> None:
        """Damage bytes on their way to the unit."""
        self.far_end.to_device.add(damage)

    def damage_to_host(self, damage: Damage) -> None:
        """Damage bytes on their way to the host."""
        self.far_end.to_host.add(damage)

    def hit_a_limit(self) -> None:
        """Let the pan axis run into its limit."""
        with self.lock:
            self.far_end.hit_a_limit()

    def power_cycle(self) -> None:
        """Switch its supply off and on."""
        with self.lock:
            self.far_end.power_cycle()

    def unplug(self) -> None:
        """Pull its serial cable."""
        with self.lock:
            self.far_end.unplug()

    def plug(self) -> None:
        """Put the cable back."""
        with self.lock:
            self.far_end.plug()

    def advance(self, t_ns: int) -> None:
        """Let the unit do what was due by `t_ns`, if that has come: the world looks at it."""
        with self.lock:
            self.far_end.advance(min(t_ns, self.clock.now_ns()))
