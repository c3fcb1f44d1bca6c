"""Start of a session with a Grbl board: identify it, bring it to rest, check its settings."""

from collections.abc import Sequence

from foveacam_hardware.contract import DeviceFault, NotConnected
from foveacam_hardware.drivers.positioners.grbl_axes import GrblAxis
from foveacam_hardware.drivers.positioners.grbl_session import GrblSession, SentLine
from foveacam_hardware.wire.grbl import (
    BUILD_INFO,
    JOG_CANCEL,
    RESET,
    SETTINGS,
    GrblMessage,
    GrblSetting,
    GrblStatusReport,
)

GREETING_TRIES = 12
"""Requests for a report, 0.3 s each: a board that restarts when its port opens needs two seconds."""
RESET_AFTER = 8
REST_TRIES = 20
SETTINGS_S = 5.0
"""Deadline for the settings, which are read from slow memory."""
TRAVEL = 130
"""Setting number of X's travel; those of Y and Z follow."""
MOVING = frozenset({"Jog", "Run", "Home"})
READY = frozenset({"Idle", "Alarm"})


def greet(session: GrblSession, axes: Sequence[GrblAxis], *, name: str, has_switches: bool) -> str:
    """Bring the board to rest, check its settings and return its version; raise when it is not usable."""
    session.discard_input()
    report = _first_report(session, name)
    for _ in range(REST_TRIES):
        if report.state in READY and session.position(report) is not None:  # else an alarm has silenced it
            break
        if report.state in MOVING:
            session.realtime(JOG_CANCEL)
            session.listen(0.1)
        else:
            session.reset()
        report = session.report()
    else:
        raise DeviceFault(f"{name}: it stays in state {report.state}; release it at the board, connect again")
    version = _version(session.ask(BUILD_INFO, deadline_s=SETTINGS_S))
    messages = session.ask(SETTINGS, deadline_s=SETTINGS_S).messages
    settings = {setting.number: setting.value for setting in messages if isinstance(setting, GrblSetting)}
    _check(settings, axes, name=name, has_switches=has_switches)
    count = len(session.position(report) or ())
    for axis in axes:
        if axis.index >= count:
            raise DeviceFault(
                f"{name}: its board has {count} axes, and {axis.name} is assigned to {axis.letter}; use a"
                " board with more, or take it out of the rig file"
            )
    return version


def _first_report(session: GrblSession, name: str) -> GrblStatusReport:
    for count in range(GREETING_TRIES):
        if count == RESET_AFTER:  # a board locked by a limit switch answers nothing until a reset
            session.realtime(RESET)
        try:
            return session.report(tries=1)
        except NotConnected as silence:
            if count == GREETING_TRIES - 1:
                raise NotConnected(
                    f"{name}: nothing that speaks Grbl answers there; check port, cable and supply, then"
                    " connect again"
                ) from silence
    raise AssertionError("the last try returns or raises")


def _version(sent: SentLine) -> str:
    for message in sent.messages:
        if isinstance(message, GrblMessage) and message.text.startswith("VER:"):
            return message.text.removeprefix("VER:").rstrip(":")
    return "unknown"


def _check(settings: dict[int, float], axes: Sequence[GrblAxis], *, name: str, has_switches: bool) -> None:
    """Raise `DeviceFault` for settings with which the board would move wrongly or not at all."""
    if settings.get(13):
        raise DeviceFault(f"{name}: it reports in inches; set $13=0 at the board, then connect again")
    if has_switches and not settings.get(22, 1):
        raise DeviceFault(
            f"{name}: homing is switched off at the board ($22=0), so its position is unknown; set $22=1,"
            " or `has_switches = false` in the rig file"
        )
    for axis in axes:
        travel, number = settings.get(TRAVEL + axis.index), TRAVEL + axis.index
        if travel is not None and axis.span > travel + 1e-6:
            raise DeviceFault(
                f"{name}: the rig file lets {axis.name} {axis.verb} by {axis.span:g} {axis.unit}, the board"
                f" allows {travel:g}; narrow the rig file's limits, or raise the board's travel (${number})"
            )
