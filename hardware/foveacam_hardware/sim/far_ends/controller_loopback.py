"""The controller's far end in the same process, on simulated time: the fastest host there is.

A write runs the far end until it has nothing left to do, moving the clock from event to event, so a
whole session takes no time and always runs the same way. The driver's reader thread works as ever.
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
"""Two links may lead to one far end (a port that is opened again): each gets the answers to what it wrote."""
MAX_READ_S = 0.005
"""A reader is let go this often, so that a session closes at once."""


class LoopbackLink:
    """A `Link` to a far end in this process. A new one is what opening the port again is."""

    def __init__(self, far_end: ControllerFarEnd, clock: Clock) -> None:
        self._far_end = far_end
        self._clock = clock
        self._arrived = threading.Condition()
        self._inbox = bytearray()
        self._open = True
        self._listening = False  # whether the reader has dealt with all that it was given, and waits
        self.identity = PortIdentity(name="simulated")
        self._check()

    @property
    def file(self) -> int | None:
        """None: there is no port."""
        return None

    def backlog(self) -> Backlog:
        """Nothing ever waits."""
        return NO_BACKLOG

    @property
    def quiet(self) -> bool:
        """Whether the reader has dealt with all there is: a write lets the far end finish first."""
        with self._arrived:
            return self._listening and not self._inbox

    def write(self, data: bytes) -> None:
        """Hand `data` to the far end, and let it finish."""
        with self._arrived, _EXCHANGE_LOCK:
            self._check()
            self._far_end.feed(data)
            while self._far_end.busy and (due_ns := self._far_end.next_event_ns()) is not None:
                self._clock.sleep_until_ns(due_ns)
                self._far_end.advance(due_ns)
            self._inbox += self._far_end.take_output()
            self._arrived.notify_all()

    def read(self, timeout_s: float) -> bytes:
        """Return what the far end has answered."""
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
        """Change how it behaves; what is None stays."""
        far_end = self.far_end
        far_end.strict = far_end.strict if strict is None else strict
        far_end.silent = far_end.silent if silent is None else silent
        far_end.fragile = far_end.fragile if fragile is None else fragile
        far_end.firmware.clock_ppm = far_end.firmware.clock_ppm if clock_ppm is None else clock_ppm

    def damage_to_device(self, damage: LineDamage) -> None:
        """Damage bytes on their way to the controller."""
        self.far_end.to_device.add(damage)

    def damage_to_host(self, damage: LineDamage) -> None:
        """Damage bytes on their way to the host."""
        self.far_end.to_host.add(damage)

    def heal(self) -> None:
        """Take back the damage that has not happened yet."""
        self.far_end.to_device.clear()
        self.far_end.to_host.clear()

    def die(self) -> None:
        """Let it stop for good, rail as it is."""
        self.far_end.die()

    def power_cycle(self) -> None:
        """Switch its supply off and on."""
        self.far_end.power_cycle()

    def unplug(self, *, keep_power: bool = False) -> None:
        """Pull the cable; it goes dark as well unless something else feeds it."""
        self.far_end.unplug(keep_power=keep_power)

    def plug(self) -> None:
        """Put the cable back."""
        self.far_end.plug()

    def status(self) -> ControllerStatus:
        """Return how it is."""
        far_end = self.far_end
        return ControllerStatus(
            dead=far_end.dead, enabled=far_end.firmware.enabled, malformed=far_end.malformed
        )
