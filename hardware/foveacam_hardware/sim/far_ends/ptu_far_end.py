"""A FLIR unit seen from its serial port: bytes in, bytes out, in its own good time.

A host (pty process or loopback) gives it time. What breaks is an attribute or a method.
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
"""From a word's end to its reply: a few bytes at 9600 baud, and thinking."""
_DELIMITER = re.compile(rb"[ \r\n]")


class PtuFarEnd:
    """A unit; its faults are attributes, as those of `grbl_far_end.GrblFarEnd`. `start`: where it stands."""

    def __init__(self, clock: Clock, cables: PanTiltCables, *, start: AxisPositions = ZERO_POSITIONS) -> None:
        self._clock = clock
        self.to_device = LineFaults()
        self.to_host = LineFaults()
        self.silent = False
        self.unplugged = False
        self.slow_ns = 0
        self.words_received: deque[str] = deque(maxlen=4096)
        """What the host has asked, for those who check what a driver sends."""
        self._out = PendingAnswers(clock, self.to_host)
        self._agenda = Agenda()
        self._partial = b""
        self._inbox: deque[str] = deque()
        self.firmware = PtuFirmware(
            clock.now_ns(), agenda=self._agenda, cables=cables, send=self._send, start=start
        )

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
        *words, self._partial = _DELIMITER.split(self._partial + self.to_device.apply(data))
        self._inbox.extend(word.decode("ascii", "replace") for word in words if word)
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
        refuse_unknown_faults(changes, {"silent", "slow_ns", "seized", "steps_per_s"})
        self.silent = changes.get("silent", self.silent)
        self.slow_ns = changes.get("slow_ns", self.slow_ns)
        self.firmware.seized = changes.get("seized", self.firmware.seized)
        if "steps_per_s" in changes:
            self.firmware.set_motor_speed(changes["steps_per_s"])

    def power_cycle(self) -> None:
        """Lose the supply and come back, wherever the rig stands then."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        self._out.clear()
        self._inbox.clear()
        self._partial = b""
        self.firmware.boot(t_ns)

    def hit_a_limit(self) -> None:
        """Let the pan axis run into its limit, as a cable that has caught lets it."""
        t_ns = self._clock.now_ns()
        self.advance(t_ns)
        self.firmware.hit_a_limit(t_ns)

    def unplug(self) -> None:
        """Pull the serial cable: the unit has a supply of its own, and goes on."""
        self.unplugged = True
        self._out.clear()

    def plug(self) -> None:
        """Put the cable back."""
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
