"""A simulated FLIR pan-tilt unit at its serial port: bytes in, bytes out, with the unit's delays.

A pty process or a loopback advances its time. The firmware is in `ptu_firmware`.
"""

import re
from collections import deque
from typing import Unpack

from foveacam_hardware.contract import Clock
from foveacam_hardware.sim.agenda import Agenda
from foveacam_hardware.sim.far_ends.board_far_end import BoardFaults, PendingAnswers, refuse_unknown_faults
from foveacam_hardware.sim.far_ends.line_faults import LineFaults
from foveacam_hardware.sim.far_ends.ptu_firmware import PtuFirmware
from foveacam_hardware.sim.pan_tilt import ZERO_POSITIONS, AxisPositions, PanTiltCables

ANSWER_NS = 9_000_000
"""Delay from the end of a command to its reply: a few bytes at 9600 baud, and computing."""
_DELIMITER = re.compile(rb"[ \r\n]")


class PtuFarEnd:
    """A unit; faults as of `grbl_far_end.GrblFarEnd`. `start`: its positions."""

    def __init__(self, clock: Clock, cables: PanTiltCables, *, start: AxisPositions = ZERO_POSITIONS) -> None:
        self._clock = clock
        self.to_device = LineFaults()
        self.to_host = LineFaults()
        self.silent = False
        self.unplugged = False
        self.slow_ns = 0
        self.words_received: deque[str] = deque(maxlen=4096)
        """The last commands, for tests of what a driver sends."""
        self._out = PendingAnswers(clock, self.to_host)
        self._agenda = Agenda()
        self._partial = b""
        self._inbox: deque[str] = deque()
        self.firmware = PtuFirmware(
            clock.now_ns(), agenda=self._agenda, cables=cables, send=self._send, start=start
        )

    @property
    def state(self) -> str:
        """The state of the firmware: idle, await or reset."""
        return self.firmware.state

    def feed(self, data: bytes) -> None:
        """Receive bytes from the host, now."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        if self.silent or self.unplugged:
            return
        *words, self._partial = _DELIMITER.split(self._partial + self.to_device.apply(data))
        self._inbox.extend(word.decode("ascii", "replace") for word in words if word)
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
        refuse_unknown_faults(changes, {"silent", "slow_ns", "seized", "steps_per_s"})
        self.silent = changes.get("silent", self.silent)
        self.slow_ns = changes.get("slow_ns", self.slow_ns)
        self.firmware.seized = changes.get("seized", self.firmware.seized)
        if "steps_per_s" in changes:
            self.firmware.set_motor_speed(changes["steps_per_s"])

    def power_cycle(self) -> None:
        """Switch the supply off and on, wherever the axes are."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        self._out.clear()
        self._inbox.clear()
        self._partial = b""
        self.firmware.boot(t_ns)

    def hit_a_limit(self) -> None:
        """Let the pan axis run into its limit, as a caught cable does."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        self.firmware.hit_a_limit(t_ns)

    def unplug(self) -> None:
        """Unplug the serial cable; the unit has a supply of its own and goes on."""
        self.unplugged = True
        self._out.clear()

    def plug(self) -> None:
        """Plug the cable in again."""
        self.unplugged = False

    def _drain(self, t_ns: int) -> None:
        while self._inbox and not self.firmware.blocked:
            word = self._inbox.popleft()
            self.words_received.append(word)
            self.firmware.execute(t_ns, word)

    def _send(self, t_ns: int, line: str) -> None:
        if self.silent or self.unplugged:
            return
        self._out.add_line(line, ready_ns=t_ns + ANSWER_NS + self.slow_ns, gap_ns=ANSWER_NS)
