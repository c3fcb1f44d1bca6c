"""Runs the server's hardware thread on a rig without HTTP and live views; functions that wait."""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.camera_config import CamerasConfig
from foveacam_hardware.contract import DeviceFault, Frame, Mirrors, MonotonicClock
from foveacam_hardware.rig import Rig, open_rig
from foveacam_hardware.rig_config import SerialMirrorsConfig, SerialRigConfig
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.rig.device_reconnector import MIRRORS
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.live_views import LiveRates
from foveacam_server.rig.ports import AssembledRig as RigPort
from foveacam_server.rig.schema import OverlayDocument
from foveacam_server.rig.view_pace import ExpectedRate

_Answer = TypeVar("_Answer")
OPEN_PATIENCE_S = 60.0
POLL_S = 0.004


def controller_rig(port: str, cameras: CamerasConfig | None = None) -> Rig:
    """Return a serial rig on the controller of a port, with some cameras or none."""
    config = SerialRigConfig(
        kind="serial",
        rig_id="bench",
        mirrors=SerialMirrorsConfig(port=port),
        cameras=cameras or CamerasConfig(),
    )
    return open_rig(config)


class BenchHost:
    """A hardware thread on a rig, as a context manager. `rate_hz`: rate of its looks and wide frames."""

    def __init__(self, rig: Rig, *, rate_hz: float = 1.0, folder: Path | None = None) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="foveacam-bench-")
        self.store = Store(folder or Path(self._folder.name))
        self.events = EventLog(self.store)
        self._rig = rig
        self.hardware = HardwareThread(
            lambda: self._rig,
            sink=_NullSink(),
            events=self.events,
            clock=MonotonicClock(),
            overlay=lambda _gaze: None,
            limits=LiveRates(wide_hz=rate_hz, fovea_hz=rate_hz),
        )

    def __enter__(self) -> "BenchHost":
        self.hardware.start()
        if not self.hardware.wait_open(OPEN_PATIENCE_S) or not self.mirrors.state.enabled:
            raise DeviceFault(f"the bench's rig did not open: {self.hardware.status.problems}")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.hardware.close()
        self.events.close()
        self.store.close()
        self._folder.cleanup()

    @property
    def mirrors(self) -> Mirrors:
        """The driver itself, for reading its state only."""
        return self._rig.mirrors

    @property
    def mirrors_faulty(self) -> bool:
        """Whether the server reports a problem of the mirrors."""
        return not self.mirrors.state.connected or self.has_problem(MIRRORS)

    def has_problem(self, *devices: str) -> bool:
        """Return whether the server reports a problem of one of `devices`."""
        return any(problem.device in devices for problem in self.hardware.status.problems)

    def run_on_mirrors(self, work: Callable[[Mirrors], _Answer], *, timeout_s: float) -> _Answer:
        """Run work with the mirrors on the hardware thread; raise its error, or `TimeoutError`."""

        def with_rig(rig: RigPort) -> _Answer:
            return work(rig.mirrors)

        return self.hardware.submit(with_rig).result(timeout_s)


class _NullSink:
    """A frame sink that discards everything."""

    def publish_frame(self, frame: Frame, *, meta: OverlayDocument | None = None) -> None:
        """Discard it."""

    def publish_picture(self, name: str, image: NDArray[np.uint8], *, t_ns: int) -> None:
        """Discard it."""

    def watched(self, view: str) -> bool:
        """Return True, so that frames come at the bench's rate."""
        return True

    def expect(self, view: str, expected: ExpectedRate | None) -> None:
        """Ignore it."""
        del view, expected

    def wants_every(self, view: str) -> bool:
        """Return False: nothing is recorded."""
        return False


def seconds_until(condition: Callable[[], bool], *, since_ns: int, within_s: float) -> float | None:
    """Return the seconds from `since_ns` until the condition holds; None if it does not within `within_s`."""
    while not condition():
        if time.monotonic_ns() - since_ns > within_s * 1e9:
            return None
        time.sleep(POLL_S)
    return (time.monotonic_ns() - since_ns) / 1e9


def sleep_until(began_ns: int, pause_s: float) -> None:
    """Sleep until `pause_s` after `began_ns`."""
    time.sleep(max(0.0, pause_s - (time.monotonic_ns() - began_ns) / 1e9))
