"""Start of a session with a FLIR unit: identify it, configure it, check its steps, range and speed."""

import math
from contextlib import suppress

from foveacam_hardware.contract import DeviceFault, NotConnected, PanTiltLimits, PanTiltPose
from foveacam_hardware.drivers.positioners.ptu_axes import ARC_SECOND_RAD, PtuAxes, PtuMounting
from foveacam_hardware.drivers.positioners.ptu_session import CommandRefused, PtuSession
from foveacam_hardware.wire.ptu import (
    ECHO_OFF,
    IMMEDIATE,
    INDEPENDENT,
    LIMITS_ON,
    TERSE,
    VERSION,
    PtuAxis,
    PtuQuery,
    speed,
)

GREETING_TRIES = 3
"""Attempts, about a second each. A unit that homes after power-on is silent for half a minute."""


def greet(session: PtuSession, name: str) -> str:
    """Check that a FLIR unit answers, and return its version."""
    session.discard_input()
    session.end_line()
    for _ in range(GREETING_TRIES):
        with suppress(NotConnected):
            return session.ask(VERSION).text
    reply = f" (it sent {session.unparsed!r})" if session.unparsed else ""
    raise NotConnected(
        f"{name}: no FLIR pan-tilt unit answers there{reply}; check port, baud, cable and supply, give a unit"
        " that was just switched on half a minute, then connect again"
    )


def prepare(session: PtuSession, mounting: PtuMounting, limits: PanTiltLimits, *, name: str) -> PtuAxes:
    """Configure the unit and return its axes; raise `DeviceFault` when it cannot fulfil the rig file."""
    session.ask(ECHO_OFF)
    session.quiet = True
    for command in (TERSE, LIMITS_ON, IMMEDIATE):
        session.ask(command)
    with suppress(CommandRefused):  # older units have no other mode
        session.ask(INDEPENDENT)
    axes = PtuAxes(
        mounting=mounting,
        pan_step_rad=session.number(PtuAxis.PAN, PtuQuery.RESOLUTION) * ARC_SECOND_RAD,
        tilt_step_rad=session.number(PtuAxis.TILT, PtuQuery.RESOLUTION) * ARC_SECOND_RAD,
    )
    if not (axes.pan_step_rad > 0.0 and axes.tilt_step_rad > 0.0):
        raise DeviceFault(f"{name}: it reports a step of size zero; switch it off and on, connect again")
    _check_reach(session, axes, limits, name=name)
    _set_speed(session, PtuAxis.PAN, axes.pan_step_rad, mounting.speed_rad_s, name=name)
    _set_speed(session, PtuAxis.TILT, axes.tilt_step_rad, mounting.speed_rad_s, name=name)
    return axes


def _check_reach(session: PtuSession, axes: PtuAxes, limits: PanTiltLimits, *, name: str) -> None:
    corners = (
        axes.steps(PanTiltPose(pan_rad=limits.pan_min_rad, tilt_rad=limits.tilt_min_rad)),
        axes.steps(PanTiltPose(pan_rad=limits.pan_max_rad, tilt_rad=limits.tilt_max_rad)),
    )
    for index, axis in enumerate((PtuAxis.PAN, PtuAxis.TILT)):
        asked = sorted(corner[index] for corner in corners)
        low, high = session.number(axis, PtuQuery.LOWEST), session.number(axis, PtuQuery.HIGHEST)
        if asked[0] < low or asked[1] > high:
            lowest, highest = axes.bearing((round(low),) * 2), axes.bearing((round(high),) * 2)
            key = f"{axis.name.lower()}_rad"
            ends_deg = sorted(math.degrees(getattr(end, key)) for end in (lowest, highest))
            raise DeviceFault(
                f"{name}: the rig file lets {axis.name.lower()} turn farther than the unit does, which"
                f" reaches {ends_deg[0]:.1f} to {ends_deg[1]:.1f} deg; narrow the rig file's limits"
            )


def _set_speed(session: PtuSession, axis: PtuAxis, step_rad: float, speed_rad_s: float, *, name: str) -> None:
    asked = round(speed_rad_s / step_rad)
    slowest, fastest = session.number(axis, PtuQuery.SLOWEST), session.number(axis, PtuQuery.FASTEST)
    if not slowest <= asked <= fastest:
        raise DeviceFault(
            f"{name}: speed_deg_s = {math.degrees(speed_rad_s):g} is outside what {axis.name.lower()} can do,"
            f" {math.degrees(slowest * step_rad):.2f} to {math.degrees(fastest * step_rad):.1f} deg/s;"
            " change it in the rig file"
        )
    session.ask(speed(axis, asked))
