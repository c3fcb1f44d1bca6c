"""The simulated mirror controller at its serial port: a state machine, bytes in, bytes out.

A pty process or a loopback advances its time. With `strict` it also has the faults of the controllers in
the field (faults 1 to 3 of the protocol page), so that tests show that a driver does not trigger them.
"""

from collections import deque
from collections.abc import Sequence

from foveacam_hardware.contract import Clock, Role
from foveacam_hardware.sim.agenda import Agenda
from foveacam_hardware.sim.cables import Cables
from foveacam_hardware.sim.far_ends.controller_firmware import ControllerFirmware
from foveacam_hardware.sim.far_ends.line_faults import LineFaults
from foveacam_hardware.wire.cobs import CobsDecoder
from foveacam_hardware.wire.controller import (
    GUARDED_ONLY,
    BadChecksum,
    BadPacket,
    Packet,
    decode_packet,
)

NOISE_REPLY = bytes.fromhex("05 a7 3c 91 44 00")
"""Reply of a controller in the field to a malformed packet: valid framing, wrong checksum."""


class ControllerFarEnd:
    """A mirror controller; its faults are attributes.

    `to_device` and `to_host` damage bytes; `silent`: ignores its input and sends nothing; `dead`: has stopped
    until a power cycle, its pins unchanged; `unplugged`: no link to the host; `fragile`: goes dead at the
    first frame that it cannot decode, as firmware 2.1.0 does of truncated packets.
    """

    def __init__(
        self,
        clock: Clock,
        cables: Cables,
        *,
        strict: bool = False,
        version: tuple[int, int, int] = (2, 1, 0),
    ) -> None:
        self._clock = clock
        self.to_device = LineFaults()
        self.to_host = LineFaults()
        self.silent = False
        self.fragile = False
        self.unplugged = False
        self.dead = False
        self.packets_received: deque[Packet] = deque(maxlen=4096)
        """The last requests, for tests of what a driver sends."""
        self.malformed = 0
        """Frames since power-up that were no valid packets."""
        self._out = bytearray()
        self._decoder = CobsDecoder()
        self._inbox: deque[bytes | None] = deque()
        self._agenda = Agenda()
        self.firmware = ControllerFirmware(
            clock.now_ns(), agenda=self._agenda, cables=cables, send=self._send, version=version
        )
        self.strict = strict

    @property
    def strict(self) -> bool:
        """Whether it has the faults of the controllers in the field."""
        return self.firmware.frames.strict

    @strict.setter
    def strict(self, strict: bool) -> None:
        self.firmware.frames.strict = strict

    def be_flawed(self, *, strobe_delay_us: Sequence[int], clock_ppm: float) -> None:
        """Set the delays of the (left, right) strobes and how much faster its clock runs."""
        self.firmware.frames.strobe_delay_us = dict(
            zip((Role.LEFT, Role.RIGHT), strobe_delay_us, strict=True)
        )
        self.firmware.clock_ppm = clock_ppm

    @property
    def busy(self) -> bool:
        """Whether anything but the recovery once a second is planned."""
        return self._agenda.next_ns() is not None

    def feed(self, data: bytes) -> None:
        """Receive bytes from the host, now."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        if self.silent or self.dead or self.unplugged:
            return
        self._inbox.extend(self._decoder.feed(self.to_device.apply(data)))
        self._drain(t_ns)
        self.advance(t_ns)

    def take_output(self) -> bytes:
        """Return the bytes for the host since the last call."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def next_event_ns(self) -> int | None:
        """Return the time of the next planned event; None without one."""
        planned_ns = self._agenda.next_ns()
        if self.dead or not self.firmware.enabled:
            return planned_ns
        return min(self.firmware.recovery_ns, planned_ns or self.firmware.recovery_ns)

    def advance(self, t_ns: int) -> None:
        """Run everything due up to `t_ns`."""
        while (due_ns := self._agenda.next_ns()) is not None and due_ns <= t_ns:
            self._agenda.run_until(due_ns)
            self._drain(due_ns)
        if not self.dead:
            self.firmware.recover(t_ns)

    def die(self) -> None:
        """Stop for good, pins unchanged: the rail stays on. Only a power cycle recovers it."""
        self.dead = True
        self._agenda.clear()
        self._inbox.clear()

    def power_cycle(self) -> None:
        """Switch the supply off and on; it starts with the factory settings."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        self.dead = False
        self.malformed = 0
        self._out.clear()
        self._inbox.clear()
        self._decoder.reset()
        self.firmware.boot(t_ns)

    def unplug(self, *, keep_power: bool = False) -> None:
        """Unplug the USB cable; unless `keep_power`, the controller loses its supply too."""
        self.unplugged = True
        self._out.clear()
        if not keep_power:
            self.power_cycle()

    def plug(self) -> None:
        """Plug the USB cable in again."""
        self.unplugged = False

    def _drain(self, t_ns: int) -> None:
        while self._inbox and not self.firmware.blocked and not self.dead:
            self._receive(t_ns, self._inbox.popleft())

    def _receive(self, t_ns: int, frame: bytes | None) -> None:
        try:
            request = decode_packet(frame)
            if request.prop in GUARDED_ONLY:
                raise BadPacket(f"{request.prop.name} is unknown to this firmware")
        except BadChecksum:
            self.malformed += 1
            if self.fragile:
                self.die()
            elif self.strict:
                self._send(NOISE_REPLY)
        except BadPacket:
            self.malformed += 1
            if self.strict or self.fragile:
                self.die()
        else:
            self.packets_received.append(request)
            answered = len(self._out)
            if not self.firmware.execute(t_ns, request) and self.fragile:
                del self._out[answered:]
                self.die()

    def _send(self, data: bytes) -> None:
        if not (self.silent or self.dead or self.unplugged):
            self._out += self.to_host.apply(data)
