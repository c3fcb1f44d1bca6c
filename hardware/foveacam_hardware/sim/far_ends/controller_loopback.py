"""The simulated mirror controller in this process, on virtual time.

A write runs the far end until it has no planned event, and advances the clock from event to event: a
session takes no real time and is deterministic. The driver's reader thread works as with a real port.
"""

import threading

from foveacam_hardware.contract import Clock, NotConnected
from foveacam_hardware.sim.cables import Cables
from foveacam_hardware.sim.far_ends.controller_far_end import ControllerFarEnd
from foveacam_hardware.sim.far_ends.line_faults import LineDamage
from foveacam_hardware.sim.far_ends.side_channel import ControllerStatus
from foveacam_hardware.wire.link import NO_BACKLOG, Backlog
from foveacam_hardware.wire.usb_ports import PortIdentity

_EXCHANGE_LOCK = threading.Lock()
"""Two links may share one far end (a port opened again); each gets the answers to its own requests."""
MAX_READ_S = 0.005
"""Longest wait of a read, so that a session closes at once."""


class LoopbackLink:
    """A `Link` to a far end in this process; a new one stands for opening the port again."""

    def __init__(self, far_end: ControllerFarEnd, clock: Clock) -> None:
        self._far_end = far_end
        self._clock = clock
        self._arrived = threading.Condition()
        self._inbox = bytearray()
        self._open = True
        self._listening = False  # whether the reader has processed its data and waits
        self.identity = PortIdentity(name="simulated")
        self._check()

    @property
    def file(self) -> int | None:
        """Always None: there is no port."""
        return None

    def backlog(self) -> Backlog:
        """Always empty."""
        return NO_BACKLOG

    @property
    def quiet(self) -> bool:
        """Whether the reader has processed all data; a write returns after the far end has finished."""
        with self._arrived:
            return self._listening and not self._inbox

    def write(self, data: bytes) -> None:
        """Send `data` to the far end, and run it until it is idle."""
        with self._arrived, _EXCHANGE_LOCK:
            self._check()
            self._far_end.feed(data)
            while self._far_end.busy and (due_ns := self._far_end.next_event_ns()) is not None:
                self._clock.sleep_until_ns(due_ns)
                self._far_end.advance(due_ns)
            self._inbox += self._far_end.take_output()
            self._arrived.notify_all()

    def read(self, timeout_s: float) -> bytes:
        """Return what the far end has sent."""
        with self._arrived:
            if not self._inbox:
                self._listening = True
                self._arrived.wait(min(timeout_s, MAX_READ_S))
            self._check()
            data = bytes(self._inbox)
            self._inbox.clear()
            self._listening = not data
            return data

    def close(self) -> None:
        """Release the link."""
        with self._arrived:
            self._open = False
            self._arrived.notify_all()

    def _check(self) -> None:
        if self._far_end.unplugged or not self._open:
            raise NotConnected(
                "simulated controller: the link is gone; plug the controller in again and reconnect"
            )


class LoopbackController:
    """A simulated controller in this process, with the faults of `controller_process.ControllerProcess`."""

    def __init__(
        self, clock: Clock, cables: Cables, *, strict: bool = False, version: tuple[int, int, int] = (2, 1, 0)
    ) -> None:
        self.clock = clock
        self.far_end = ControllerFarEnd(clock, cables, strict=strict, version=version)

    def open(self) -> LoopbackLink:
        """Open its port, as a driver's link factory."""
        return LoopbackLink(self.far_end, self.clock)

    def configure(
        self,
        *,
        strict: bool | None = None,
        silent: bool | None = None,
        fragile: bool | None = None,
        clock_ppm: float | None = None,
    ) -> None:
        """Change its behaviour; None changes nothing."""
        far_end = self.far_end
        far_end.strict = far_end.strict if strict is None else strict
        far_end.silent = far_end.silent if silent is None else silent
        far_end.fragile = far_end.fragile if fragile is None else fragile
        far_end.firmware.clock_ppm = far_end.firmware.clock_ppm if clock_ppm is None else clock_ppm

    def damage_to_device(self, damage: LineDamage) -> None:
        """Damage bytes sent to the controller."""
        self.far_end.to_device.add(damage)

    def damage_to_host(self, damage: LineDamage) -> None:
        """Damage bytes sent to the host."""
        self.far_end.to_host.add(damage)

    def heal(self) -> None:
        """Cancel the damage that has not happened yet."""
        self.far_end.to_device.clear()
        self.far_end.to_host.clear()

    def die(self) -> None:
        """Stop it for good, its rail unchanged."""
        self.far_end.die()

    def power_cycle(self) -> None:
        """Switch its supply off and on."""
        self.far_end.power_cycle()

    def unplug(self, *, keep_power: bool = False) -> None:
        """Unplug the cable; unless `keep_power`, it loses its supply too."""
        self.far_end.unplug(keep_power=keep_power)

    def plug(self) -> None:
        """Plug the cable in again."""
        self.far_end.plug()

    def status(self) -> ControllerStatus:
        """Return its status."""
        far_end = self.far_end
        return ControllerStatus(
            dead=far_end.dead, enabled=far_end.firmware.enabled, malformed=far_end.malformed
        )
