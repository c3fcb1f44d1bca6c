"""The pan-tilt's controller seen from its serial port: bytes in, bytes out, in its own good time.

A host (pty process or loopback) gives it time. Answers come late, as a small microcontroller's do; what
breaks is an attribute or a method.
"""

from collections import deque
from typing import Unpack

from foveacam_hardware.contract import Clock
from foveacam_hardware.sim.agenda import Agenda
from foveacam_hardware.sim.far_ends.board_far_end import BoardFaults, PendingAnswers, refuse_unknown_faults
from foveacam_hardware.sim.far_ends.grbl_firmware import GrblFirmware
from foveacam_hardware.sim.far_ends.line_faults import LineFaults
from foveacam_hardware.sim.pan_tilt import ZERO_POSITIONS, AxisPositions, PanTiltCables
from foveacam_hardware.wire.grbl import REALTIME, GrblLineReader

ANSWER_NS = 1_500_000
"""From a byte's arrival to its answer's: reading, thinking, 115 200 baud."""


class GrblFarEnd:
    """A Grbl board; its faults are attributes.

    `to_device` and `to_host` damage bytes; `silent` ignores and says nothing; `unplugged` has no link to the
    host; `slow_ns` delays every answer by so much more. `start`: where its motors stand.
    """

    def __init__(
        self,
        clock: Clock,
        cables: PanTiltCables,
        *,
        has_rail: bool = False,
        start: AxisPositions = ZERO_POSITIONS,
    ) -> None:
        self._clock = clock
        self.to_device = LineFaults()
        self.to_host = LineFaults()
        self.silent = False
        self.unplugged = False
        self.slow_ns = 0
        self.lines_received: deque[str] = deque(maxlen=4096)
        """What the host has asked, for those who check what a driver sends."""
        self._out = PendingAnswers(clock, self.to_host)
        self._agenda = Agenda()
        self._reader = GrblLineReader()
        self._inbox: deque[str] = deque()
        self.firmware = GrblFirmware(
            clock.now_ns(), agenda=self._agenda, cables=cables, send=self._send, start=start
        )
        if has_rail:
            self.firmware.add_rail()

    @property
    def state(self) -> str:
        """What it is doing, in its own word."""
        return self.firmware.state

    def feed(self, data: bytes) -> None:
        """Take bytes from the host, now."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        if self.silent or self.unplugged:
            return
        for byte in self.to_device.apply(data):
            if self.firmware.ignores_input:
                continue
            self._take_byte(t_ns, bytes((byte,)))
        self._drain(t_ns)

    def take_output(self) -> bytes:
        """Return the bytes for the host that have come up since the last call."""
        return self._out.take_output()

    def next_event_ns(self) -> int | None:
        """Return when something will happen by itself; None when nothing will."""
        return self._out.next_event_ns(self._agenda.next_ns())

    def advance(self, t_ns: int) -> None:
        """Do everything that was due up to `t_ns`."""
        while (due_ns := self._agenda.next_ns()) is not None and due_ns <= t_ns:
            self._agenda.run_until(due_ns)
            self._drain(due_ns)

    def set_faults(self, **changes: Unpack[BoardFaults]) -> None:
        """Change how it behaves; what is left out stays."""
        refuse_unknown_faults(changes, {"silent", "slow_ns", "seized", "has_switches", "settings"})
        firmware = self.firmware
        self.silent = changes.get("silent", self.silent)
        self.slow_ns = changes.get("slow_ns", self.slow_ns)
        firmware.seized = changes.get("seized", firmware.seized)
        firmware.has_switches = changes.get("has_switches", firmware.has_switches)
        settings = changes.get("settings", {})
        firmware.settings.update({int(number): value for number, value in settings.items()})

    def power_cycle(self) -> None:
        """Lose the supply and come back, wherever the rig stands then."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        self._agenda.clear()
        self._out.clear()
        self._inbox.clear()
        self.firmware.boot(t_ns)

    def hit_a_limit(self) -> None:
        """Let a limit switch trip, as a cable that has caught does."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        self.firmware.hit_a_limit(t_ns)

    def unplug(self) -> None:
        """Pull the USB cable: the board goes out as well."""
        self.power_cycle()
        self.unplugged = True
        self._out.clear()

    def plug(self) -> None:
        """Put the USB cable back."""
        self.unplugged = False
        self.power_cycle()

    def _take_byte(self, t_ns: int, byte: bytes) -> None:
        if byte in REALTIME:
            if byte == b"\x18":
                self._inbox.clear()
                self._reader = GrblLineReader()
            self.firmware.execute_realtime(t_ns, byte)
        elif byte == b"\n":
            self._inbox.extend(self._reader.feed(byte) or [""])
        else:
            self._inbox.extend(self._reader.feed(byte))

    def _drain(self, t_ns: int) -> None:
        while self._inbox and not self.firmware.blocked:
            line = self._inbox.popleft()
            self.lines_received.append(line)
            self.firmware.execute_line(t_ns, line)

    def _send(self, t_ns: int, line: str) -> None:
        if self.silent or self.unplugged:
            return
        self._out.add_line(line, ready_ns=t_ns + ANSWER_NS + self.slow_ns)
