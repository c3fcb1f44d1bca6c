"""The binning of the rig's cameras: its working binning, but for sessions and recordings that ask another."""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

from foveacam_hardware.contract import Binning, Camera, CameraPhase, FoveaError
from foveacam_hardware.contract.spans import span
from foveacam_server.rig.ports import AssembledRig

_log = logging.getLogger(__name__)

OPEN = (CameraPhase.READY, CameraPhase.STREAMING, CameraPhase.DEGRADED)


class RigBinning:
    """Switches all cameras at once. The hardware thread applies what any thread asks for."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._recorded: list[Binning] = []
        self._session: Binning | None = None
        self._refused: Binning | None = None

    def wanted(self, rig: AssembledRig) -> Binning:
        """Return the binning to be in force: a recording's before a session's before the rig's own."""
        with self._lock:
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
        """Let the session that has the rig choose; None for the rig's own."""
        with self._lock:
            self._session = binning
        try:
            yield
        finally:
            with self._lock:
                self._session = None

    def apply(self, rig: AssembledRig) -> None:
        """Switch the cameras that have another binning, all or none; raise what a camera refuses it with.

        A camera that is not connected is left alone: it is switched when it is back.
        """
        wanted = self.wanted(rig)
        cameras = [camera for camera in (rig.wide, rig.left, rig.right) if camera.link.phase in OPEN]
        others = [camera for camera in cameras if camera.settings.binning != wanted]
        if not others:
            self._refused = None
            return
        with span("binning"):
            _switch(others, wanted)
        self._refused = None
        _log.debug("the cameras bin by %d", wanted)

    def keep(self, rig: AssembledRig) -> None:
        """Apply without failing; what was refused is logged once, and the cameras stay as they were."""
        if self._refused == self.wanted(rig):
            return
        try:
            self.apply(rig)
        except FoveaError as error:
            self._refused = self.wanted(rig)
            _log.warning("the cameras stay at their binning: %s", error)


def _switch(cameras: list[Camera], wanted: Binning) -> None:
    """Switch all cameras, or leave them as they were and raise."""
    before = [camera.settings for camera in cameras]
    try:
        for camera in cameras:
            camera.configure(replace(camera.settings, binning=wanted))
    except FoveaError:
        for camera, settings in zip(cameras, before, strict=True):
            with suppress(FoveaError):
                camera.configure(settings)
        raise
