"""A hardware thread on a fake rig, and what it tells."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from foveacam_hardware.contract import MonotonicClock
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.live_views import LiveRates
from tests.support.devices.fake_rig import FakePanTilt, FakeRig, Pictures

PATIENCE_S = 10.0
POLL_S = 0.01


class HardwareSetup:
    """A hardware thread on a fake rig."""

    def __init__(self, folder: Path) -> None:
        self.store = Store(folder)
        self.events = EventLog(self.store)
        self.clock = MonotonicClock()
        self.rig = FakeRig(self.clock)
        self.pictures = Pictures()
        self.hardware = HardwareThread(
            lambda: self.rig,
            sink=self.pictures,
            events=self.events,
            clock=self.clock,
            overlay=lambda _gaze: None,
            limits=LiveRates(wide_hz=100.0, fovea_hz=60.0),
        )

    def start(self) -> HardwareThread:
        self.hardware.start()
        assert self.hardware.wait_open(PATIENCE_S)
        return self.hardware

    def close(self) -> None:
        if self.rig.head.hold is not None:
            self.rig.head.hold.set()
        self.hardware.close()
        self.events.close()
        self.store.close()

    @property
    def pan_tilt(self) -> FakePanTilt:
        assert self.rig.pan_tilt is not None
        return self.rig.pan_tilt

    def wait_for(self, kind: str) -> dict[str, object]:
        """Return the data of an event of a kind once there is one."""
        waiting = threading.Event()
        for _ in range(round(PATIENCE_S / POLL_S)):
            for event in self.events.recent(200):
                if event.kind == kind:
                    return event.data
            waiting.wait(POLL_S)
        raise AssertionError(kind)


@contextmanager
def hardware_setup(folder: Path) -> Iterator[HardwareSetup]:
    """A hardware thread that ends with the context; it is not started."""
    found = HardwareSetup(folder)
    try:
        yield found
    finally:
        found.close()


def never() -> bool:
    """Nobody cancels."""
    return False
