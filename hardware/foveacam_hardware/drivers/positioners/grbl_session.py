"""One session with a Grbl board: matches answers to lines and stores the reports in between.

There is no thread: a caller that waits reads the link. Answers arrive in the order of the lines; a late
answer is still matched to its own line, and a missing one is given up after some reports.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from foveacam_hardware.contract import Clock, DeviceFault, NotConnected, Timeout
from foveacam_hardware.wire.grbl import (
    RESET,
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
from foveacam_hardware.wire.link import ByteLink, discard_input

logger = logging.getLogger(__name__)

REPORT_S = 0.3
REPORT_TRIES = 3
LINE_S = 3.0
"""Deadline of an answer: usually milliseconds, longer while a setting is written to slow memory."""
MUTE_NS = 1_000_000_000
"""Time that a board may be silent after an alarm before it is reset, which is all that it then answers to."""
GREETING_NS = 3_000_000_000
"""Deadline of the answer to that reset."""
UNWATCHED_NS = 1_000_000_000
"""Time between two reports in which a board may have restarted unnoticed."""
LOST_AFTER_REPORTS = 3
"""Reports after a line's deadline at which its missing answer counts as lost."""
SLICE_S = 0.05


@dataclass(slots=True, eq=False)
class SentLine:
    """A sent line: `answer` is None until it arrives; `lost` when it never will."""

    line: str
    answer: GrblOk | GrblRefused | None = None
    lost: bool = False
    messages: list[GrblMessage | GrblSetting] = field(default_factory=list)
    """Messages and settings that came before the answer."""
    reports_since: int | None = None


class LineRefused(DeviceFault):
    """A line was refused; nothing moved."""

    def __init__(self, name: str, refused: GrblRefused, line: str) -> None:
        super().__init__(f"{name}: {line!r} was refused ({refused}); nothing moved")
        self.reason = refused


class GrblSession:
    """A link and the state received over it; one thread sends lines, any thread may send real-time bytes."""

    def __init__(self, link: ByteLink, clock: Clock, *, name: str) -> None:
        self._link = link
        self._clock = clock
        self.name = self._name = name
        self._reader = GrblLineReader()
        self._sent: deque[SentLine] = deque()
        self._lock = threading.RLock()
        self._offset: tuple[float, ...] = (0.0, 0.0)
        self._report: GrblStatusReport | None = None
        self._reported_ns = clock.now_ns()
        self.alarm: GrblAlarm | None = None
        """The last alarm; cleared by whoever handles it."""
        self._mute_since_ns: int | None = None
        """Time since which the board is silent because of its alarm."""
        self._mute_reset = False
        """Whether a mute board has been reset."""
        self.restarts = 0
        """Number of greetings received."""
        self.may_have_restarted = False
        """Whether a restart may have gone unnoticed: bytes were lost, or a report looks like the first one.

        Cleared by the caller that has checked it.
        """

    def realtime(self, byte: bytes) -> None:
        """Send a real-time byte, without waiting."""
        self._link.write(byte)

    def reset(self) -> None:
        """Reset the board, which clears its alarm, and wait for its greeting, `LINE_S` at most.

        What is sent before the greeting is lost. A report is no proof of the reset: it may be a late one.
        """
        with self._lock:
            before, self.alarm = self.restarts, None
            self.realtime(RESET)
            self._listen_until(lambda: self.restarts != before, LINE_S)

    def report(self, *, tries: int = REPORT_TRIES) -> GrblStatusReport:
        """Request a status report and return it; raise `NotConnected` when none comes."""
        with self._lock:
            if self._is_mute():
                return GrblStatusReport(state="Alarm")
            for _ in range(tries):
                self._report = None
                self.realtime(STATUS)
                self._listen_until(lambda: self._latest() is not None, REPORT_S)
                if (found := self._latest()) is not None:
                    return found
                self.may_have_restarted = True
                if self.alarm is not None:  # after some alarms the board is silent until it is reset
                    self._mute_since_ns, self._mute_reset = self._clock.now_ns(), False
                    return GrblStatusReport(state="Alarm")
        raise NotConnected(
            f"{self._name}: it was asked {tries} times where it stands and did not answer;"
            " check its cable and its supply, then connect it again"
        )

    def position(self, report: GrblStatusReport) -> tuple[float, ...] | None:
        """Return the machine position of a report, in axis order and the axes' units; None: it has none."""
        if report.machine is not None or report.work is None:
            return report.machine
        work = report.work
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
        """Send a line and wait; raise `DeviceFault` when it is refused, `Timeout` when no answer comes."""
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
        """End a line that the board may have in part, unanswered; it then answers that line."""
        self._link.write(encode(""))

    def listen(self, timeout_s: float = 0.0) -> None:
        """Process what has arrived or arrives within the time."""
        with self._lock:
            for text in self._reader.feed(self._link.read(timeout_s)):
                try:
                    self._process(parse(text))
                except BadGrblLine:
                    self.may_have_restarted = True
                    logger.warning("%s: not a line of Grbl's: %r", self._name, text[:80])

    def discard_input(self) -> None:
        """Discard what was sent before anybody asked: answers and reports of an earlier session."""
        discard_input(self._link)

    def close(self) -> None:
        """Release the link."""
        self._link.close()

    def _is_mute(self) -> bool:
        """Request a report without waiting, and return whether the previous request was not answered.

        A board that stays mute is reset, once; raise `NotConnected` when it does not answer that either.
        """
        if self._mute_since_ns is None or self.alarm is None:
            return False
        self.listen()
        if self._mute_since_ns is None or self._report is not None:
            self._mute_since_ns = None
            return False
        mute_ns = self._clock.now_ns() - self._mute_since_ns
        if mute_ns > MUTE_NS + GREETING_NS:
            raise NotConnected(
                f"{self._name}: it is silent since its {self.alarm}, and did not answer a reset;"
                " check its cable and its supply, then connect it again"
            )
        if mute_ns > MUTE_NS and not self._mute_reset:
            self._mute_reset = True
            self.realtime(RESET)
        self.realtime(STATUS)
        return True

    def _latest(self) -> GrblStatusReport | None:
        return self._report

    def _listen_until(self, done: Callable[[], bool], timeout_s: float) -> None:
        deadline_ns = self._clock.now_ns() + round(timeout_s * 1e9)
        while not done() and (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            self.listen(min(SLICE_S, left_ns / 1e9))

    def _process(self, line: Line) -> None:
        match line:
            case GrblOk() | GrblRefused():
                self._answer(line)
            case GrblStatusReport():
                self._note_report(line)
            case GrblAlarm():
                self.alarm = line
            case GrblWelcome():
                self.restarts += 1
                self._mute_since_ns = None
                self._mark_all_lost()
            case GrblMessage() | GrblSetting():
                if self._sent:
                    self._sent[0].messages.append(line)

    def _note_report(self, report: GrblStatusReport) -> None:
        now_ns = self._clock.now_ns()
        # Grbl reports its work offset in the first report after a start, and then in every tenth or so.
        if report.offset is not None or now_ns - self._reported_ns > UNWATCHED_NS:
            self.may_have_restarted = True
        self._report, self._reported_ns = report, now_ns
        self._offset = report.offset or self._offset
        self._expire_answers()

    def _answer(self, answer: GrblOk | GrblRefused) -> None:
        if self._sent:
            self._sent.popleft().answer = answer
        else:
            logger.warning("%s: an answer to no line (%s)", self._name, answer)

    def _expire_answers(self) -> None:
        """Mark lines as lost whose answers have been overdue for several reports."""
        for sent in self._sent:
            if sent.reports_since is not None:
                sent.reports_since += 1
        while self._sent and (self._sent[0].reports_since or 0) >= LOST_AFTER_REPORTS:
            self._sent.popleft().lost = True

    def _mark_all_lost(self) -> None:
        for sent in self._sent:
            sent.lost = True
        self._sent.clear()
