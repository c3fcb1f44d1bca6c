"""Proof that a Grbl board has not restarted: a number in its working memory that a start or reset clears.

The number is the programmed feed, which jogs neither use nor change (`wire.grbl.feed`). A work offset (G92)
would not do: grblHAL may keep one over a loss of power.
"""

from foveacam_hardware.contract import NotConnected, Timeout
from foveacam_hardware.drivers.positioners.grbl_session import GrblSession, LineRefused, SentLine
from foveacam_hardware.wire.grbl import PARSER_STATE, GrblMessage, feed, programmed_feed

ANSWER_S = 1.0
"""Deadline of an answer; a jog that is being stopped delays it by a quarter of a second."""
TRIES = 3
SMALLEST, COUNT = 1_000_000, 9_000_000
"""Marks have seven digits: the board counts them exactly, and no program uses such a feed."""


def mark_at(t_ns: int) -> int:
    """Return the mark for a position that became known at a time."""
    return SMALLEST + t_ns // 1_000 % COUNT


def write_mark(session: GrblSession, mark: int) -> None:
    """Store a mark in the board's memory; raise `NotConnected` when the board does not keep it."""
    for _ in range(TRIES):
        if _ask(session, feed(mark)) is not None and has_mark(session, mark):
            return
    raise NotConnected(
        f"{session.name}: it does not keep the number {mark} as its feed, by which a restart is noticed;"
        " check its cable, connect it again"
    )


def has_mark(session: GrblSession, mark: int) -> bool:
    """Return whether the board still has a mark; raise `NotConnected` when it does not answer.

    A mark that differs is read again: Grbl has no checksum.
    """
    answered = False
    for _ in range(TRIES):
        sent = _ask(session, PARSER_STATE)
        messages = [] if sent is None else sent.messages
        feeds = [programmed_feed(message) for message in messages if isinstance(message, GrblMessage)]
        if mark in feeds:
            return True
        answered = answered or any(found is not None for found in feeds)
    if answered:
        return False
    raise NotConnected(
        f"{session.name}: it was asked {TRIES} times for its state and did not report it;"
        " check its cable and its supply, then connect it again"
    )


def _ask(session: GrblSession, line: str) -> SentLine | None:
    """Send a line and wait; return None when it was refused or not answered: bytes were lost."""
    try:
        return session.ask(line, deadline_s=ANSWER_S)
    except LineRefused:
        return None
    except Timeout:
        session.end_line()
        return None
