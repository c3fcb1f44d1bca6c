"""One conversation with a Grbl board: which answer belongs to which line, and what came in between.

No thread of its own: who waits, reads. Answers come in the order of the lines; one that comes too late is
still told apart from that of the next line, and one that never comes is written off.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from foveacam_hardware.contract import Clock, DeviceFault, NotConnected, Timeout
from foveacam_hardware.wire.grbl import (
    STATUS,
    BadGrblLine,
    GrblAlarm,
    GrblLineReader,
    GrblMessage,
    GrblOk,
    GrblRefused,
    GrblSetting,
    GrblStatusReport,
    GrblWelcome,
    Line,
    encode,
    parse,
)
from foveacam_hardware.wire.link import ByteLink

logger = logging.getLogger(__name__)

REPORT_S = 0.3
REPORT_TRIES = 3
LINE_S = 3.0
"""A move is acknowledged within milliseconds, unless a setting is being written to slow memory."""
WRITTEN_OFF_AFTER = 3
"""Reports that came after a line's deadline without its answer: it was lost on the way."""
SLICE_S = 0.05


@dataclass(slots=True, eq=False)
class SentLine:
    """A line on its way: `answer` is None until it comes; `lost` when it never will."""

    line: str
    answer: GrblOk | GrblRefused | None = None
    lost: bool = False
    told: list[GrblMessage | GrblSetting] = field(default_factory=list)
    """Messages and settings that came before the answer."""
    reports_since: int | None = None


class LineRefused(DeviceFault):
    """A line was understood, or misunderstood, and refused; nothing moved."""

    def __init__(self, name: str, refused: GrblRefused, line: str) -> None:
        super().__init__(f"{name}: {line!r} was refused ({refused}); nothing moved")
        self.reason = refused


class GrblSession:
    """A link and what is known from it; one thread talks, any thread may send a realtime byte."""

    def __init__(self, link: ByteLink, clock: Clock, *, name: str) -> None:
        self._link = link
        self._clock = clock
        self._name = name
        self._reader = GrblLineReader()
        self._sent: deque[SentLine] = deque()
        self._lock = threading.RLock()
        self._offset: tuple[float, ...] = (0.0, 0.0)
        self._report: GrblStatusReport | None = None
        self.alarm: GrblAlarm | None = None
        """The last alarm that it told; who acts on it clears it."""
        self._mute = False
        """Whether it has fallen silent over its alarm."""
        self.restarts = 0
        """How often it has said hello."""
        self.bad_lines = 0
        """Lines that were none."""

    def realtime(self, byte: bytes) -> None:
        """Send a byte that jumps the queue; waits for nothing."""
        self._link.write(byte)

    def report(self, *, tries: int = REPORT_TRIES) -> GrblStatusReport:
        """Ask where it stands; raise `NotConnected` when it does not say."""
        with self._lock:
            if self._mute and self.alarm is not None and self._is_still_mute():
                return GrblStatusReport(state="Alarm")
            for _ in range(tries):
                self._report = None
                self.realtime(STATUS)
                self._listen_until(lambda: self._latest() is not None, REPORT_S)
                if (found := self._latest()) is not None:
                    return found
                if self.alarm is not None:  # after some it says nothing until it is reset
                    self._mute = True
                    return GrblStatusReport(state="Alarm")
        raise NotConnected(
            f"{self._name}: it was asked {tries} times where it stands and said nothing;"
            " check its cable and its supply, then connect it again"
        )

    def place(self, report: GrblStatusReport) -> tuple[float, ...]:
        """Return the machine position that a report tells, an axis after the other, in its own units."""
        if report.machine is not None:
            return report.machine
        work = report.work or (0.0, 0.0)
        offset = (*self._offset, *(0.0 for _ in work[len(self._offset) :]))
        return tuple(at + off for at, off in zip(work, offset, strict=False))

    def begin(self, line: str) -> SentLine:
        """Send a line without waiting for its answer."""
        with self._lock:
            sent = SentLine(line)
            self._sent.append(sent)
            self._link.write(encode(line))
            return sent

    def ask(self, line: str, *, deadline_s: float = LINE_S) -> SentLine:
        """Send a line and wait; raise `DeviceFault` when it is refused, `Timeout` when nothing comes."""
        with self._lock:
            sent = self.begin(line)
            self._listen_until(lambda: sent.answer is not None or sent.lost, deadline_s)
            if isinstance(sent.answer, GrblRefused):
                raise LineRefused(self._name, sent.answer, line)
            if sent.answer is None:
                sent.reports_since = 0
                raise Timeout(
                    f"{self._name}: {line!r} was not answered within {deadline_s:g} s; ask again, and if it"
                    " stays silent check its cable and reconnect"
                )
            return sent

    def end_line(self) -> None:
        """End what the board may have of a line that it did not answer; it answers for that line now."""
        self._link.write(encode(""))

    def listen(self, timeout_s: float = 0.0) -> None:
        """Take in what has arrived, or arrives within the time."""
        with self._lock:
            for text in self._reader.feed(self._link.read(timeout_s)):
                try:
                    self._take(parse(text))
                except BadGrblLine:
                    self.bad_lines += 1
                    logger.warning("%s: not a line of Grbl's: %r", self._name, text[:80])

    def close(self) -> None:
        """Release the link."""
        self._link.close()

    def _is_still_mute(self) -> bool:
        """Ask without waiting, and take in what was said to the question before."""
        self.listen()
        self._mute = self._report is None
        self.realtime(STATUS)
        return self._mute

    def _latest(self) -> GrblStatusReport | None:
        return self._report

    def _listen_until(self, done: Callable[[], bool], timeout_s: float) -> None:
        deadline_ns = self._clock.now_ns() + round(timeout_s * 1e9)
        while not done() and (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            self.listen(min(SLICE_S, left_ns / 1e9))

    def _take(self, line: Line) -> None:
        match line:
            case GrblOk() | GrblRefused():
                self._answer(line)
            case GrblStatusReport():
                self._report = line
                self._offset = line.offset or self._offset
                self._write_off()
            case GrblAlarm():
                self.alarm = line
            case GrblWelcome():
                self.restarts += 1
                self._void_all()
            case GrblMessage() | GrblSetting():
                if self._sent:
                    self._sent[0].told.append(line)

    def _answer(self, answer: GrblOk | GrblRefused) -> None:
        if self._sent:
            self._sent.popleft().answer = answer
        else:
            logger.warning("%s: an answer to no line (%s)", self._name, answer)

    def _write_off(self) -> None:
        """Forget the lines whose answers have been overdue for several reports."""
        for sent in self._sent:
            if sent.reports_since is not None:
                sent.reports_since += 1
        while self._sent and (self._sent[0].reports_since or 0) >= WRITTEN_OFF_AFTER:
            self._sent.popleft().lost = True

    def _void_all(self) -> None:
        for sent in self._sent:
            sent.lost = True
        self._sent.clear()
