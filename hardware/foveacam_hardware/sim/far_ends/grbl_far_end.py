"""A simulated Grbl board at its serial port: bytes in, bytes out, with the delays of a microcontroller.

A pty process or a loopback advances its time. The firmware is in `grbl_firmware`.
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
"""Delay from a byte to its answer: reading, computing, 115 200 baud."""


class GrblFarEnd:
    """A Grbl board; its faults are attributes.

    `to_device` and `to_host` damage bytes; `silent`: ignores its input and sends nothing; `unplugged`: no
    link to the host; `slow_ns`: additional delay of every answer. `start`: positions of its motors.
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
        """The last lines from the host, for tests of what a driver sends."""
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
        """The state of the firmware, in Grbl's own term."""
        return self.firmware.state

    def feed(self, data: bytes) -> None:
        """Receive bytes from the host, now."""
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
        """Return the bytes for the host that are due."""
        return self._out.take_output()

    def next_event_ns(self) -> int | None:
        """Return the time of the next planned event; None without one."""
        return self._out.next_event_ns(self._agenda.next_ns())

    def advance(self, t_ns: int) -> None:
        """Run everything due up to `t_ns`."""
        while (due_ns := self._agenda.next_ns()) is not None and due_ns <= t_ns:
            self._agenda.run_until(due_ns)
            self._drain(due_ns)

    def set_faults(self, **changes: Unpack[BoardFaults]) -> None:
        """Change faults; keys left out are not changed."""
        refuse_unknown_faults(changes, {"silent", "slow_ns", "seized", "has_switches", "settings"})
        firmware = self.firmware
        self.silent = changes.get("silent", self.silent)
        self.slow_ns = changes.get("slow_ns", self.slow_ns)
        firmware.seized = changes.get("seized", firmware.seized)
        firmware.has_switches = changes.get("has_switches", firmware.has_switches)
        settings = changes.get("settings", {})
        firmware.settings.update({int(number): value for number, value in settings.items()})

    def power_cycle(self) -> None:
        """Switch the supply off and on, wherever the axes are."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        self._agenda.clear()
        self._out.clear()
        self._inbox.clear()
        self.firmware.boot(t_ns)

    def hit_a_limit(self) -> None:
        """Trip a limit switch, as a caught cable does."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        self.firmware.hit_a_limit(t_ns)

    def unplug(self) -> None:
        """Unplug the USB cable: the board loses its supply too."""
        self.power_cycle()
        self.unplugged = True
        self._out.clear()

    def plug(self) -> None:
        """Plug the USB cable in again."""
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
