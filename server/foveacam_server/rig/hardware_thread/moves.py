"""Looks, wide frames and moves as the hardware thread carries them out; failures go to the reconnector.

Whether a look or a move is allowed is checked by others.
"""

import logging
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from foveacam_hardware.contract import PARKED, FoveaError, Frame, LookOptions, Role, Sighting, StereoVolts
from foveacam_hardware.contract.spans import span
from foveacam_server.foundation.watching import timings
from foveacam_server.foundation.watching.flows import HARDWARE, MIRRORS, count_flow
from foveacam_server.rig.device_reconnector import DeviceReconnector
from foveacam_server.rig.live_views import LiveViews
from foveacam_server.rig.ports import AssembledRig

_log = logging.getLogger(__name__)
T = TypeVar("T")


class RigMoves:
    """Carries out looks and moves; keeps the mirrors' last commanded volts.

    Parks again when a move races the stop. Called by the hardware thread, except `halt`, `resume` and
    `keep_gaze`, which any thread may call.
    """

    def __init__(
        self, *, live: LiveViews, reconnector: DeviceReconnector, in_session: Callable[[], bool]
    ) -> None:
        self._live = live
        self._reconnector = reconnector
        self._in_session = in_session
        self._halted = threading.Event()
        self._gaze = PARKED

    @property
    def halted(self) -> bool:
        """Whether the stop is engaged."""
        return self._halted.is_set()

    @property
    def gaze(self) -> StereoVolts:
        """The mirrors' last commanded volts."""
        return self._gaze

    def halt(self) -> None:
        """Keep the mirrors parked: a look or move under way is followed by another parking."""
        self._halted.set()
        self._gaze = PARKED

    def resume(self) -> None:
        """End the effect of `halt`."""
        self._halted.clear()

    def keep_gaze(self, volts: StereoVolts) -> None:
        """Record the volts to which others have sent the mirrors; a stop in between wins."""
        self._gaze = volts
        if self.halted:
            self._gaze = PARKED

    def look(self, rig: AssembledRig, volts: StereoVolts, *, options: LookOptions) -> Sighting:
        """Look once and show the frames."""
        self._live.start_look_period()
        if options.one_eyed:
            options = replace(options, missing=self._reconnector.fovea_lost(rig))
        with timings.LOOK.time(), span("look"):
            sighting = self._exposed(
                rig, lambda: rig.head.look(volts, options=options), missing=options.missing
            )
        if not self.halted:
            self._gaze = sighting.volts if rig.replayed else rig.mirrors.state.volts
        self._live.show_sighting(sighting, in_session=self._in_session())
        return sighting

    def expose(self, rig: AssembledRig, work: Callable[[AssembledRig], T]) -> T:
        """Run work that steers and exposes by itself."""
        with span("exposure"):
            found = self._exposed(rig, lambda: work(rig))
        if not self.halted:
            self._gaze = rig.mirrors.state.volts
        return found

    def wide(self, rig: AssembledRig, *, gaze: StereoVolts | None, max_age_ms: float) -> Frame:
        """Show and return the newest wide frame; `gaze`: None while it is unknown."""
        self._live.start_wide_period(in_session=self._in_session())
        try:
            frame = self._live.show_wide(rig, gaze=gaze, max_age_ms=max_age_ms)
        except FoveaError as error:
            self._reconnector.wide_failed(error)
            raise
        self._reconnector.wide_succeeded()
        return frame

    def steer(self, rig: AssembledRig, volts: StereoVolts) -> StereoVolts:
        """Move both mirrors; return the volts really set."""
        count_flow(HARDWARE, MIRRORS, "moves")
        try:
            with span("mirrors.steer"):
                self._gaze = rig.mirrors.steer(volts)
        except FoveaError as error:
            self._reconnector.look_failed(rig, error)
            raise
        finally:
            self._park_again_if_halted(rig)
        return self._gaze

    def park(self, rig: AssembledRig) -> None:
        """Bring both mirrors to rest."""
        self._gaze = PARKED
        without_failing("park", rig.mirrors.park)

    def _exposed(self, rig: AssembledRig, look: Callable[[], T], *, missing: Role | None = None) -> T:
        """Run a look; on an error record the failed device; park again if the stop was engaged meanwhile."""
        count_flow(HARDWARE, MIRRORS, "moves")
        try:
            found = look()
        except FoveaError as error:
            self._reconnector.look_failed(rig, error, exposing=True)
            raise
        finally:
            self._park_again_if_halted(rig)
        self._reconnector.look_succeeded(missing=missing)
        return found

    def _park_again_if_halted(self, rig: AssembledRig) -> None:
        if self.halted:  # the stop came between a move's check and its command on the wire
            self.park(rig)


def without_failing(what: str, work: Callable[[], object]) -> bool:
    """Run work whose failure the reconnector has reported; return whether it succeeded."""
    try:
        work()
    except FoveaError as error:
        _log.debug("%s: %s", what, error)
        return False
    return True
