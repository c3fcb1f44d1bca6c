"""Turning of the base until the target is at a gaze and at rest, by the pan-tilt's motors or by hand."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    Clock,
    DeviceFault,
    Head,
    NotConnected,
    PanTilt,
    PanTiltPose,
    Station,
    Timeout,
)
from foveacam_pipeline.calibrate.sweep.eye_prediction import degrees
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.sweep.markers import find_markers, middle_px
from foveacam_pipeline.calibrate.sweep.sweep_plan import base_pose
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, raise_if_cancelled
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8

MOVED_SHARE = 0.25
"""Share of `near_rad` by which a rig must have moved between two rests to count as turned."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnSettings:
    """Tolerances and waits of the base.

    `near_rad`, `still_px`: tolerances of a rig turned by hand. `beside_rad`: maximum error of its scale.
    `begin_ms`: time after which a rig that is near a gaze is measured even if it was not turned.
    """

    rest_ms: float = 50.0
    turn_ms: float = 30_000.0
    home_ms: float = 120_000.0
    poll_ms: float = 10.0
    near_rad: float = math.radians(0.6)
    beside_rad: float = math.radians(2.0)
    begin_ms: float = 3000.0
    still_px: float = 0.15
    still_frames: int = 8


class StationBase:
    """The pan-tilt at one station, as the sweep uses it."""

    def __init__(
        self,
        pan_tilt: PanTilt,
        station: Station,
        *,
        clock: Clock,
        watch: ProcedureWatcher,
        settings: TurnSettings,
    ) -> None:
        self._pan_tilt = pan_tilt
        self._station = station
        self._clock = clock
        self._watch = watch
        self._settings = settings
        self._asked_rad, self._beside_rad = np.zeros(2), np.zeros(2)

    @property
    def by_hand(self) -> bool:
        """Whether it is turned by hand."""
        return not self._pan_tilt.moves_itself

    def prepare(self) -> None:
        """Wait until it is at rest; home it when its position is unknown."""
        self._check()
        self._wait("the pan-tilt's last move", timeout_ms=self._settings.home_ms)
        if not self.by_hand and not self._pan_tilt.state.homed:
            self._pan_tilt.home()
            self._until_homed()

    def turn_to(self, node_rad: NDArray[np.float64]) -> PanTiltPose | None:
        """Turn until the target is at a gaze, (2,) rad; return the pose of the base."""
        self._check()
        self._pan_tilt.move_to(base_pose(node_rad, self._station.pose))
        self._wait("the pan-tilt's move", timeout_ms=self._settings.turn_ms)
        self._clock.sleep_until_ns(self._clock.now_ns() + round(self._settings.rest_ms * 1e6))
        return self._pan_tilt.state.pose

    def request(self, node_rad: NDArray[np.float64]) -> None:
        """Show the operator who turns the base by hand the pose for a gaze, (2,) rad."""
        self._check()
        self._asked_rad = node_rad
        self._pan_tilt.move_to(base_pose(node_rad + self._beside_rad, self._station.pose))

    def correct(self, missed_rad: NDArray[np.float64]) -> None:
        """Add the target's error, (2,) rad, to this and all later requests, and repeat the request.

        The zero of a tripod's scale is arbitrary.
        """
        limit_rad = self._settings.beside_rad
        self._beside_rad = np.clip(self._beside_rad + missed_rad, -limit_rad, limit_rad)
        self.request(self._asked_rad)

    def hold(self) -> None:
        """Stop the base at its present pose."""
        if not self.by_hand and self._pan_tilt.state.connected:
            self._pan_tilt.hold()

    def _until_homed(self) -> None:
        self._wait("the pan-tilt's homing", timeout_ms=self._settings.home_ms)
        if not self._pan_tilt.state.homed:
            raise DeviceFault(
                "pan-tilt: it was asked to home, it stopped and still does not know where it stands; "
                "check its reference switches"
            )

    def _wait(self, what: str, *, timeout_ms: float) -> None:
        deadline_ns = self._clock.now_ns() + round(timeout_ms * 1e6)
        while self._pan_tilt.state.moving:
            raise_if_cancelled(self._watch, doing="the sweep")
            if self._clock.now_ns() > deadline_ns:
                raise Timeout(
                    f"{what}: not over within {timeout_ms / 1e3:g} s; free it, then resume the sweep"
                )
            self._clock.sleep_until_ns(self._clock.now_ns() + round(self._settings.poll_ms * 1e6))
        self._check()

    def _check(self) -> None:
        state = self._pan_tilt.state
        if not state.connected:
            raise NotConnected(
                "pan-tilt: a sweep needs it, it is not connected; plug it in and resume the sweep"
            )
        if state.fault is not None:
            raise DeviceFault(f"pan-tilt: {state.fault}; clear the fault and resume the sweep")


def _no_correction(missed_rad: NDArray[np.float64]) -> None:
    """Do nothing: the operator sees the error in the progress note."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HandTurnedBase:
    """Watches the wide view while the operator turns the rig, until the target rests near a wanted gaze.

    `correct`: called with the error, (2,) rad, when the target rests beside the first gaze.
    """

    head: Head
    clock: Clock
    watch: ProcedureWatcher
    wide: Intrinsics
    layout: MarkerLayout
    settings: TurnSettings
    correct: Callable[[NDArray[np.float64]], None] = _no_correction

    def wait_for(self, nodes_rad: NDArray[np.float64], *, done: int, total: int) -> int:
        """Return the index of the gaze, (n, 2) rad, near which the target rests; gaze 0 is the requested one.

        A rig that already rests near a gaze is accepted only after `begin_ms`, to give the operator time.
        """
        middles: list[NDArray[np.float64]] = []
        last_seq = -1
        begun_ns, has_turned = self.clock.now_ns() + round(self.settings.begin_ms * 1e6), False
        rested: NDArray[np.float64] | None = None  # gaze at the start or at the last correction
        while True:
            raise_if_cancelled(self.watch, doing="the sweep")
            frame = self.head.wide(max_age_ms=0.0)
            if frame.seq == last_seq:
                self.clock.sleep_until_ns(self.clock.now_ns() + round(self.settings.poll_ms * 1e6))
                continue
            last_seq = frame.seq
            found = find_markers(
                gray(to_uint8(frame)),
                side_m=self.layout.side_m,
                only=(self.layout.wide_id,),
                binning=frame.binning,
            ).get(self.layout.wide_id)
            if found is None:
                middles = []
                self._report("no marker of the wide camera in view", nodes_rad[0], done, total)
                continue
            middles = [*middles, middle_px(found)][-self.settings.still_frames :]
            gaze = self.wide.angles_rad(middles[-1][None])[0]
            off = np.abs(nodes_rad - gaze).max(axis=1)
            nearest = int(np.argmin(off))
            still = self._still(middles)
            rested = gaze if rested is None else rested
            turned = bool(np.abs(gaze - rested).max() > MOVED_SHARE * self.settings.near_rad)
            has_turned = has_turned or turned or self.clock.now_ns() >= begun_ns
            if off[nearest] <= self.settings.near_rad and still and has_turned:
                return nearest
            if still and turned and np.abs(nodes_rad[0] - gaze).max() <= self.settings.beside_rad:
                rested = gaze
                self.correct(nodes_rad[0] - gaze)
            self._report(self._instruction(gaze, nodes_rad[0], still=still), nodes_rad[0], done, total)

    def _still(self, middles: list[NDArray[np.float64]]) -> bool:
        if len(middles) < self.settings.still_frames:
            return False
        return bool(np.ptp(np.array(middles), axis=0).max() <= self.settings.still_px)

    def _instruction(self, gaze: NDArray[np.float64], node: NDArray[np.float64], *, still: bool) -> str:
        """Return how the operator must turn the rig; a turn to the left moves the target to the right."""
        x, y = (node - gaze).tolist()
        aside = f"{degrees(abs(x))} to the {'left' if x > 0 else 'right'}"
        along = f"{degrees(abs(y))} {'up' if y > 0 else 'down'}"
        return (
            f"turn the rig {aside} and {along}"
            if max(abs(x), abs(y)) > self.settings.near_rad or still
            else ("hold still")
        )

    def _report(self, what: str, node: NDArray[np.float64], done: int, total: int) -> None:
        wanted = f"({degrees(float(node[0]))}, {degrees(float(node[1]))})"
        self.watch.progress(done, total=total, note=f"wanted: the target at {wanted}; {what}")
