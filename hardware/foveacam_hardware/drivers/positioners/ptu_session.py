"""One session with a FLIR pan-tilt unit: matches replies to commands and stores unrequested messages.

There is no thread: a caller that waits reads the link. Replies arrive in the order of the commands without
naming them. When one is missing, the version is queried, whose reply is unique; replies before it are
discarded.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from foveacam_hardware.contract import Clock, DeviceFault, NotConnected, Timeout
from foveacam_hardware.wire.link import ByteLink, discard_input
from foveacam_hardware.wire.ptu import (
    VERSION,
    BadPtuReply,
    Line,
    PtuAxis,
    PtuBanner,
    PtuDone,
    PtuLimitHit,
    PtuQuery,
    PtuRefused,
    PtuReplyReader,
    encode,
    is_version,
    parse,
    query,
)

logger = logging.getLogger(__name__)

REPLY_S = 0.4
"""Deadline of a reply; a D-series unit handles about ten commands a second."""
TRIES = 3
SLICE_S = 0.05


@dataclass(slots=True, eq=False)
class SentCommand:
    """A sent command: `reply` is None until it arrives; `lost` when it never will."""

    command: str
    reply: PtuDone | PtuRefused | None = None
    lost: bool = False


class CommandRefused(DeviceFault):
    """A command was refused; nothing moved."""

    def __init__(self, name: str, refused: PtuRefused, command: str) -> None:
        super().__init__(f"{name}: {command!r} was refused ({refused.reason}); nothing moved")


class PtuSession:
    """A link and the state received over it; one thread waits for replies, any thread may send a command."""

    def __init__(self, link: ByteLink, clock: Clock, *, name: str) -> None:
        self._link = link
        self._clock = clock
        self._name = name
        self._reader = PtuReplyReader()
        self._sent: deque[SentCommand] = deque()
        self._lock = threading.RLock()
        self._order = threading.Lock()  # keeps the queue in the order of the wire
        self._out_of_step = True
        self.quiet = False
        """Whether the unit's echo is known to be off."""
        self.limits_hit: list[PtuAxis] = []
        """Axes that ran into a limit; cleared by whoever handles it."""
        self.restarts = 0
        """Number of restarts, recognised by the banner or by an echo."""
        self.unparsed = ""
        """The last received line that could not be parsed."""

    def begin(self, command: str) -> SentCommand:
        """Send a command without waiting for its reply."""
        with self._order:
            sent = SentCommand(command)
            self._sent.append(sent)
            self._link.write(encode(command))
            return sent

    def ask(self, command: str) -> PtuDone:
        """Send a command and wait, repeating it without a reply; raise `DeviceFault` when it is refused."""
        with self._lock:
            for _ in range(TRIES):
                if self._out_of_step and not self._resynchronise():
                    continue
                sent = self.begin(command)
                self._wait_for(sent)
                if isinstance(sent.reply, PtuDone):
                    return sent.reply
                if isinstance(sent.reply, PtuRefused):
                    raise CommandRefused(self._name, sent.reply, command)
                self._out_of_step = True
        raise NotConnected(
            f"{self._name}: {command!r} was sent {TRIES} times and not answered; check its cable and its"
            " supply, then connect it again"
        )

    def number(self, axis: PtuAxis, what: PtuQuery) -> float:
        """Query a number of an axis."""
        for _ in range(TRIES):
            try:
                return self.ask(query(axis, what)).number
            except BadPtuReply:  # a damaged reply, or that of another command
                self._out_of_step = True
        raise Timeout(
            f"{self._name}: {query(axis, what)!r} was answered without a number {TRIES} times; check its"
            " cable, and that no other program uses the port"
        )

    def end_line(self) -> None:
        """End a command that another program may have left incomplete."""
        self._link.write(b"\r")

    def listen(self, timeout_s: float = 0.0) -> None:
        """Process what has arrived or arrives within the time."""
        with self._lock:
            for text in self._reader.feed(self._link.read(timeout_s)):
                try:
                    for line in parse(text):
                        self._process(line)
                except BadPtuReply:
                    self.unparsed = text[:40]
                    logger.warning("%s: not a reply: %r", self._name, text[:80])

    def discard_input(self) -> None:
        """Discard what was sent before anybody asked: replies of an earlier session."""
        discard_input(self._link)

    def doubt_order(self) -> None:
        """Query the version before the next command: a reply may have been taken for another command's."""
        self._out_of_step = True

    def close(self) -> None:
        """Release the link."""
        self._link.close()

    def _resynchronise(self) -> bool:
        """Query the version and discard every reply before its own; return whether it came."""
        sent = self.begin(VERSION)
        self._wait_for(sent)
        self._out_of_step = sent.reply is None
        return not self._out_of_step

    def _wait_for(self, sent: SentCommand) -> None:
        self._listen_until(lambda: sent.reply is not None or sent.lost, REPLY_S)

    def _listen_until(self, done: Callable[[], bool], timeout_s: float) -> None:
        deadline_ns = self._clock.now_ns() + round(timeout_s * 1e9)
        while not done() and (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            self.listen(min(SLICE_S, left_ns / 1e9))

    def _process(self, line: Line) -> None:
        match line:
            case PtuLimitHit():
                self.limits_hit.append(line.axis)
            case PtuBanner():
                self._note_restart()
            case PtuDone() | PtuRefused():
                if line.echo and self.quiet:
                    self._note_restart()
                self._answer(line)

    def _note_restart(self) -> None:
        if self.quiet:  # before that the unit was not known to be running
            self.restarts += 1
        self.quiet = False
        self._out_of_step = True

    def _answer(self, reply: PtuDone | PtuRefused) -> None:
        versions = [k for k, sent in enumerate(self._sent) if sent.command == VERSION]
        if isinstance(reply, PtuDone) and is_version(reply.text):
            # Assigned to the last version query: a late earlier reply is as good, a later one is ignored.
            for _ in range(versions[-1] + 1 if versions else 0):
                sent = self._sent.popleft()
                sent.reply, sent.lost = (reply, False) if sent.command == VERSION else (None, True)
        elif self._sent and 0 not in versions:
            self._sent.popleft().reply = reply
        else:
            logger.debug("%s: a reply to no command (%s)", self._name, reply)
