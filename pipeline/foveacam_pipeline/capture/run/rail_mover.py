"""Moves the rig along its rail to the position of a scan, and waits until it is at rest."""

from foveacam_hardware.contract import Cancelled, DeviceFault, OutOfRange, Rail, RailState, Timeout
from foveacam_pipeline.capture.run.access import CaptureRig, CaptureWatcher, RigAccess
from foveacam_pipeline.capture.run.values import RunSettings


class RailMover:
    """Moves the rig to the rail positions of a plan; asks the operator where the rail has no motor."""

    def __init__(self, access: RigAccess, *, watch: CaptureWatcher, settings: RunSettings) -> None:
        self._access = access
        self._watch = watch
        self._settings = settings

    def move_to(self, place_m: float) -> None:
        """Return when the rig is at a position, metres from the rail's middle."""
        if not self._access.run_still(_has_motor):
            self._access.run_still(lambda rig: _rail(rig).move_to(place_m))
            self._watch.ask_operator(f"push the rig to {1e3 * place_m:g} mm on the rail, then continue")
            return
        try:
            self._move(place_m)
        except Cancelled:
            self._access.run_still(lambda rig: _rail(rig).hold())
            raise
        clock = self._access.clock
        clock.sleep_until_ns(clock.now_ns() + round(1e6 * self._settings.rail_rest_ms))

    def _move(self, place_m: float) -> None:
        state = self._until_still("the rail's last move", timeout_ms=self._settings.rail_ms)
        self._access.check_may_move()
        if not state.homed:
            self._access.run_still(lambda rig: _rail(rig).home())
            self._until_still("the rail's homing", timeout_ms=self._settings.home_ms)
        self._access.check_may_move()
        self._access.run_still(lambda rig: _rail(rig).move_to(place_m))
        state = self._until_still("the rail's move", timeout_ms=self._settings.rail_ms)
        at_m = state.position_m
        if at_m is None or abs(at_m - place_m) > self._settings.rail_near_m:
            stands = "nobody knows where" if at_m is None else f"at {1e3 * at_m:.1f} mm"
            raise DeviceFault(
                f"rail: asked to move to {1e3 * place_m:g} mm, it stands still {stands}"
                f" ({state.fault or 'it was held'}); free it, then resume",
                asked=f"{1e3 * place_m:g} mm",
                found=f"it stands still {stands}",
                remedy="free it, then resume the capture",
            )

    def _until_still(self, what: str, *, timeout_ms: float) -> RailState:
        clock = self._access.clock
        deadline_ns = clock.now_ns() + round(1e6 * timeout_ms)
        while (state := self._access.run_still(_state)).moving:
            if self._watch.cancelled():
                raise Cancelled("the capture was cancelled while the rail moved; it can be resumed")
            if clock.now_ns() > deadline_ns:
                raise Timeout(f"{what}: not over within {timeout_ms / 1e3:g} s; free it, then resume")
            clock.sleep_until_ns(clock.now_ns() + round(1e6 * self._settings.poll_ms))
        return state


def _rail(rig: CaptureRig) -> Rail:
    if rig.rail is None:
        raise OutOfRange(
            "capture: the plan moves the rig sideways, this rig has no rail; take it from one place"
        )
    return rig.rail


def _has_motor(rig: CaptureRig) -> bool:
    return _rail(rig).moves_itself


def _state(rig: CaptureRig) -> RailState:
    return _rail(rig).state
