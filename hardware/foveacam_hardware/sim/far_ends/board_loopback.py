"""A motor controller board in this process; a read waits on the rig's clock.

On virtual time a session takes no real time and is deterministic.
"""

import threading
from typing import Generic, TypeVar, Unpack

from foveacam_hardware.contract import Clock, NotConnected
from foveacam_hardware.sim.far_ends.board_far_end import BoardFarEnd, BoardFaults
from foveacam_hardware.sim.far_ends.line_faults import LineDamage
from foveacam_hardware.wire.link import ByteLink

FarEnd = TypeVar("FarEnd", bound=BoardFarEnd)


class BoardLoopback(Generic[FarEnd]):
    """A board in this process, with the faults of `board_process.BoardProcess`."""

    def __init__(self, far_end: FarEnd, clock: Clock) -> None:
        self.clock = clock
        self.far_end = far_end
        self.lock = threading.RLock()

    def open(self) -> ByteLink:
        """Open its port, as a driver's link factory."""
        return _BoardLink(self.far_end, self.clock, self.lock)

    def close(self) -> None:
        """Do nothing: there is no process."""

    def set_faults(self, **changes: Unpack[BoardFaults]) -> None:
        """Change faults; keys left out are not changed."""
        with self.lock:
            self.far_end.set_faults(**changes)

    def damage_to_device(self, damage: LineDamage) -> None:
        """Damage bytes sent to the board."""
        self.far_end.to_device.add(damage)

    def damage_to_host(self, damage: LineDamage) -> None:
        """Damage bytes sent to the host."""
        self.far_end.to_host.add(damage)

    def hit_a_limit(self) -> None:
        """Let an axis run into its limit."""
        with self.lock:
            self.far_end.hit_a_limit()

    def power_cycle(self) -> None:
        """Switch its supply off and on."""
        with self.lock:
            self.far_end.power_cycle()

    def unplug(self) -> None:
        """Unplug the cable."""
        with self.lock:
            self.far_end.unplug()

    def plug(self) -> None:
        """Plug the cable in again."""
        with self.lock:
            self.far_end.plug()

    def advance(self, t_ns: int) -> None:
        """Run everything due up to `t_ns`, but not beyond the present time."""
        with self.lock:
            self.far_end.advance(min(t_ns, self.clock.now_ns()))


class _BoardLink:
    """A `ByteLink` to a board in this process; a new one stands for opening the port again."""

    def __init__(self, far_end: BoardFarEnd, clock: Clock, lock: threading.RLock) -> None:
        self._far_end = far_end
        self._clock = clock
        self._lock = lock
        self._open = True
        self._check()

    def write(self, data: bytes) -> None:
        """Send `data` to the board."""
        with self._lock:
            self._check()
            self._far_end.feed(data)

    def read(self, timeout_s: float) -> bytes:
        """Return what the board has sent, waiting up to `timeout_s` on the clock."""
        far_end, clock = self._far_end, self._clock
        with self._lock:
            deadline_ns = clock.now_ns() + round(timeout_s * 1e9)
            while True:
                self._check()
                far_end.advance(clock.now_ns())
                data = far_end.take_output()
                if data or clock.now_ns() >= deadline_ns:
                    return data
                due_ns = far_end.next_event_ns()
                clock.sleep_until_ns(deadline_ns if due_ns is None else min(due_ns, deadline_ns))

    def close(self) -> None:
        """Release the link."""
        self._open = False

    def _check(self) -> None:
        if self._far_end.unplugged or not self._open:
            raise NotConnected("simulated pan-tilt: the link is gone; plug it in again and reconnect")
