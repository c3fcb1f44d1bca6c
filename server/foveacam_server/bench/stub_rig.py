"""A rig of devices that cost nothing, with the real head; and access to it, on the caller's thread."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from foveacam_hardware.contract import CameraSettings, Clock, Head, PanTilt, Rail, Role
from foveacam_hardware.drivers.triggered_head import TriggeredHead
from foveacam_pipeline.capture.run import CaptureRig
from foveacam_server.bench.stub_devices import StubCamera, StubMirrors

T = TypeVar("T")


class StubRig:
    """Implements the capture's rig, with the real head; and gives access to it, on the caller's thread."""

    name = "stub"
    simulated = True
    scene = None
    baseline_m = 0.2

    def __init__(
        self,
        clock: Clock,
        *,
        rig_id: str,
        settle_us: int,
        exposure_ns: int,
        size: tuple[int, int] = (1080, 1440),
        wide_hz: float = 30.0,
    ) -> None:
        """Make one whose images have `size`, (h, w), of noise."""
        self.rig_id = rig_id
        self.clock = clock
        self.did: list[tuple[int, str]] = []
        image = np.random.default_rng(1).integers(0, 256, size, dtype=np.uint8)
        image.setflags(write=False)
        settings = CameraSettings(exposure_ns=exposure_ns, frame_rate_hz=wide_hz)

        def camera(role: Role) -> StubCamera:
            own = settings if role is Role.WIDE else replace(settings, triggered=True)
            return StubCamera(role, clock, image, self.did, own)

        self.wide, self.left, self.right = camera(Role.WIDE), camera(Role.LEFT), camera(Role.RIGHT)
        self.mirrors = StubMirrors(clock, (self.left, self.right), self.did)
        self.pan_tilt: PanTilt | None = None
        self.rail: Rail | None = None
        self.head: Head = TriggeredHead(
            self.mirrors, self.left, self.right, self.wide, clock=clock, settle_us=settle_us, pulse_us=1000
        )

    def check_may_move(self) -> None:
        """Allow it."""

    def moving(self, work: Callable[[CaptureRig], T]) -> T:
        """Do it here and now."""
        return work(self)

    def still(self, work: Callable[[CaptureRig], T]) -> T:
        """Do it here and now."""
        return work(self)
