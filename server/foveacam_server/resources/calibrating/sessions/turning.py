"""Turn the rig to a station and wait until it rests, or ask the operator to turn it."""

import math

import numpy as np

from foveacam_hardware.contract import (
    Clock,
    DeviceFault,
    Head,
    PanTilt,
    Station,
    StationTarget,
    Timeout,
)
from foveacam_pipeline.calibrate.sweep.base_turn import HandTurnedBase, StationBase, TurnSettings
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, raise_if_cancelled
from foveacam_pipeline.models.intrinsics import Intrinsics

TURN_S = 40.0
HOME_S = 120.0
POLL_NS = 20_000_000
REST_NS = 200_000_000
AHEAD = np.zeros(2)


def turn_to_station(
    pan_tilt: PanTilt,
    station: Station,
    *,
    clock: Clock,
    watch: ProcedureWatcher,
    head: Head | None = None,
    wide: Intrinsics | None = None,
) -> None:
    """Turn the rig to `station`.

    A rig turned by hand: wait until the station's markers rest in the middle of the wide view, if it has
    markers and `head` and `wide` are given; else assume that it is there.
    """
    if not pan_tilt.moves_itself:
        pan_deg, tilt_deg = math.degrees(station.pose.pan_rad), math.degrees(station.pose.tilt_rad)
        watch.progress(0, total=1, note=f"turn the rig to {station.name}: {pan_deg:.0f}°, {tilt_deg:.0f}°")
        pan_tilt.move_to(station.pose)
        if head is not None and wide is not None and station.target is StationTarget.MARKERS:
            _wait_for_markers(pan_tilt, station, head, wide, clock=clock, watch=watch)
        return
    if not pan_tilt.state.homed:
        watch.progress(0, total=1, note="homing the pan-tilt")
        pan_tilt.home()
        _wait(pan_tilt, HOME_S, what="homing", clock=clock, watch=watch)
    watch.progress(0, total=1, note=f"turning the rig to {station.name}")
    pan_tilt.move_to(station.pose)
    _wait(pan_tilt, TURN_S, what=f"turning to {station.name}", clock=clock, watch=watch)
    clock.sleep_until_ns(clock.now_ns() + REST_NS)


def _wait_for_markers(
    pan_tilt: PanTilt,
    station: Station,
    head: Head,
    wide: Intrinsics,
    *,
    clock: Clock,
    watch: ProcedureWatcher,
) -> None:
    """Wait until the markers rest in the middle of the wide view."""
    settings = TurnSettings()
    base = StationBase(pan_tilt, station, clock=clock, watch=watch, settings=settings)
    base.request(AHEAD)
    HandTurnedBase(
        head=head,
        clock=clock,
        watch=watch,
        wide=wide,
        layout=MarkerLayout(),
        settings=settings,
        correct=base.correct,
    ).wait_for(AHEAD[None], done=0, total=1)


def _wait(pan_tilt: PanTilt, longest_s: float, *, what: str, clock: Clock, watch: ProcedureWatcher) -> None:
    deadline_ns = clock.now_ns() + round(longest_s * 1e9)
    while (state := pan_tilt.state).moving:
        if watch.cancelled():
            pan_tilt.hold()
        raise_if_cancelled(watch, doing=what)
        if clock.now_ns() > deadline_ns:
            pan_tilt.hold()
            raise Timeout(f"pan-tilt: {what} was not over within {longest_s:g} s; free it and try again")
        clock.sleep_until_ns(clock.now_ns() + POLL_NS)
    if state.fault is not None:
        raise DeviceFault(f"pan-tilt: {state.fault}; clear the fault and try again")
