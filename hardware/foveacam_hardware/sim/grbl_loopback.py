"""The pan-tilt's far end in the same process: a read waits on the rig's clock.

On virtual time a whole session takes no time and always runs the same way.
"""

import threading
from collections.abc import Mapping

from foveacam_hardware.contract import Clock, NotConnected
from foveacam_hardware.sim.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.line_faults import Damage
from foveacam_hardware.sim.pan_tilt import PanTiltCables


class GrblLoopback:
    """A simulated Grbl board in this process, with the faults of `grbl_host.GrblProcess`."""

    def __init__(self, clock: Clock, cables: PanTiltCables) -> None:
        self.clock = clock
        self.far_end = GrblFarEnd(clock, cables)
        self.lock = threading.RLock()

    def open(self) -> "GrblLoopbackLink":
        """Open its port, as a driver's link factory."""
        return GrblLoopbackLink(self)

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


class GrblLoopbackLink:
    """A `Link` to a far end in this process. A new one is what opening the port again is."""

    def __init__(self, board: GrblLoopback) -> None:
        self._board = board
        self._open = True
        self._check()

    def write(self, data: bytes) -> None:
        """Hand `data` to the board."""
        with self._board.lock:
            self._check()
            self._board.far_end.feed(data)

    def read(self, timeout_s: float) -> bytes:
        """Return what the board has said, letting up to `timeout_s` go by on the clock."""
        board = self._board
        with board.lock:
            deadline_ns = board.clock.now_ns() + round(timeout_s * 1e9)
            while True:
                self._check()
                board.far_end.advance(board.clock.now_ns())
                data = board.far_end.take()
                if data or board.clock.now_ns() >= deadline_ns:
                    return data
                due_ns = board.far_end.next_event_ns()
                board.clock.sleep_until_ns(deadline_ns if due_ns is None else min(due_ns, deadline_ns))

    def close(self) -> None:
        """Release the link."""
        self._open = False

    def _check(self) -> None:
        if self._board.far_end.unplugged or not self._open:
            raise NotConnected("simulated pan-tilt: the link is gone; plug it in again and reconnect")
