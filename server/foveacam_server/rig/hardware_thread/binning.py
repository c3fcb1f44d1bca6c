"""The binning of the rig's cameras: the working binning, unless a session or recording requests another."""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

from foveacam_hardware.contract import Binning, Busy, Camera, CameraPhase, FoveaError
from foveacam_hardware.contract.spans import span
from foveacam_server.rig.ports import AssembledRig

_log = logging.getLogger(__name__)

OPEN = (CameraPhase.READY, CameraPhase.STREAMING, CameraPhase.DEGRADED)


class RigBinning:
    """Switches all cameras together. Any thread may request a binning; the hardware thread applies it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._recorded: list[Binning] = []
        self._in_session = False
        self._session: Binning | None = None
        self._refused: Binning | None = None
        self.problem: str | None = None
        """Why the cameras do not have the wanted binning; None while they have it."""
        self.switch_s: float | None = None
        """Time that the last switch of this rig's cameras took: stop, set, start; None before the first."""

    @property
    def is_recorded(self) -> bool:
        """Whether a recording keeps the binning."""
        with self._lock:
            return bool(self._recorded)

    def wanted(self, rig: AssembledRig) -> Binning:
        """Return the wanted binning: a recording's, else a session's, else the rig's own.

        A session without a choice keeps the rig's own as it was at its start.
        """
        with self._lock:
            if self._in_session and self._session is None:
                self._session = rig.working_binning
            recorded = self._recorded[0] if self._recorded else None
            return recorded or self._session or rig.working_binning

    @contextmanager
    def recorded(self, binning: Binning) -> Iterator[None]:
        """Keep one binning while a recording runs: each of its streams has one size."""
        with self._lock:
            self._recorded.append(binning)
        try:
            yield
        finally:
            with self._lock:
                self._recorded.remove(binning)

    @contextmanager
    def session(self, binning: Binning | None) -> Iterator[None]:
        """Apply a session's choice while it has the rig; None: the rig's own.

        Raise `Busy` while a recording keeps another binning than the chosen one.
        """
        with self._lock:
            recorded = self._recorded[0] if self._recorded else None
            if binning is not None and recorded not in (None, binning):
                raise _recorded_at(recorded, asked=binning)
            self._in_session, self._session = True, binning
        try:
            yield
        finally:
            with self._lock:
                self._in_session, self._session = False, None

    def choose_working(self, rig: AssembledRig, binning: Binning) -> None:
        """Change the rig's own binning; on a camera's refusal leave it, and raise the camera's error.

        While a session or a recording has the cameras, they are switched after its end.
        """
        before, rig.working_binning = rig.working_binning, binning
        try:
            self.apply(rig)
        except FoveaError:
            rig.working_binning = before
            self.keep(rig)
            raise

    def apply(self, rig: AssembledRig) -> None:
        """Switch the cameras that have another binning, all or none; raise a camera's error that refuses it.

        A camera that is not connected is switched when it is back.
        """
        wanted = self.wanted(rig)
        cameras = [camera for camera in (rig.wide, rig.left, rig.right) if camera.link.phase in OPEN]
        others = [camera for camera in cameras if camera.settings.binning != wanted]
        if others:
            began_ns = rig.clock.now_ns()
            with span("binning"):
                _switch(others, wanted)
            self.switch_s = (rig.clock.now_ns() - began_ns) / 1e9
            _log.debug("the cameras bin by %d", wanted)
        self._refused = self.problem = None

    def keep(self, rig: AssembledRig) -> None:
        """Apply without raising; a refusal is logged once, and the cameras keep their binning."""
        if self._refused == self.wanted(rig):
            return
        try:
            self.apply(rig)
        except FoveaError as error:
            self._refused, self.problem = self.wanted(rig), str(error)
            _log.warning("the cameras stay at their binning: %s", error)

    def forget(self) -> None:
        """Forget time and refusal of the cameras of a closed rig."""
        self._refused = self.problem = self.switch_s = None


def _switch(cameras: list[Camera], wanted: Binning) -> None:
    """Switch all cameras, or restore their binning and raise."""
    before = [camera.settings for camera in cameras]
    try:
        for camera in cameras:
            camera.configure(replace(camera.settings, binning=wanted))
    except FoveaError:
        for camera, settings in zip(cameras, before, strict=True):
            with suppress(FoveaError):
                camera.configure(settings)
        raise


def _recorded_at(recorded: Binning | None, *, asked: Binning) -> Busy:
    found = f"a recording keeps all cameras at binning {recorded}"
    return Busy(
        f"asked for binning {asked}: {found}",
        asked=f"binning {asked}",
        found=found,
        remedy="end the recording first",
    )
