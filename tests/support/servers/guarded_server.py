"""`foveacam serve` on a rig of metal: a real controller with its guardian, and cameras of one picture.

A capture's eyes are exposed by the controller's own receipts. With HOLD_AT_MOVE=N in the environment nothing
comes back from the Nth move on: a place to be killed at.
"""

import os
import threading

import numpy as np

from foveacam_bench.capture.stub_rig import StubCamera
from foveacam_hardware.contract import (
    CameraSettings,
    Clock,
    ExposureReceipt,
    MonotonicClock,
    PendingExposure,
    Role,
    StereoVolts,
)
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.guardian import Guardian
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.drivers.triggered_head import TriggeredHead
from foveacam_hardware.rig import Rig, RigName
from foveacam_hardware.rig_config import SerialRigConfig
from foveacam_hardware.wire.link import SerialLink
from foveacam_server import __main__ as program
from foveacam_server.assembly import first_services

HOLD = "HOLD_AT_MOVE"
RIG_ID = "sim-rig120"
"""A rig that a calibration ships for."""
EXPOSURE_NS = 5_000_000
"""As long as the strobes of the test's controller say."""
SETTLE_US, PULSE_US = 14_000, 1000
SIZE = (1080, 1440)


class Exposure:
    """An exposure of the controller's; the eyes have seen what it says was exposed."""

    def __init__(self, under_way: PendingExposure, eyes: tuple[StubCamera, StubCamera]) -> None:
        self._under_way = under_way
        self._eyes = eyes

    def wait(self) -> ExposureReceipt:
        receipt = self._under_way.wait()
        for eye in self._eyes:
            eye.expose(receipt.t_exposure_start_ns)
        return receipt


class WatchedMirrors(ControllerMirrors):
    """The real driver, which counts its moves."""

    eyes: tuple[StubCamera, StubCamera]
    moves = 0

    def begin_exposure(
        self, volts: StereoVolts, *, settle_us: int, pulse_us: int, without: Role | None = None
    ) -> PendingExposure:
        self.moves += volts != self.state.volts
        if self.moves == int(os.environ.get(HOLD, "-1")):
            threading.Event().wait()
        under_way = super().begin_exposure(volts, settle_us=settle_us, pulse_us=pulse_us, without=without)
        return Exposure(under_way, self.eyes)


def guarded_rig(config: SerialRigConfig, *, clock: Clock | None = None, guarded: bool = False) -> Rig:
    """Return the rig of a rig file as `open_rig` does, its cameras stood in for."""
    clock = clock or MonotonicClock()
    port = config.mirrors.port
    supervision = LinkSupervision(answer_s=1.0, probe_s=0.5, guardian=Guardian() if guarded else None)
    mirrors = WatchedMirrors(lambda: SerialLink(port), clock, name=port, supervision=supervision)
    image = np.random.default_rng(1).integers(0, 256, SIZE, dtype=np.uint8)
    image.setflags(write=False)

    def camera(role: Role) -> StubCamera:
        settings = CameraSettings(
            exposure_ns=EXPOSURE_NS, frame_rate_hz=30.0, triggered=role is not Role.WIDE
        )
        return StubCamera(role, clock, image, [], settings)

    wide, left, right = camera(Role.WIDE), camera(Role.LEFT), camera(Role.RIGHT)
    mirrors.eyes = left, right
    head = TriggeredHead(mirrors, left, right, wide, clock=clock, settle_us=SETTLE_US, pulse_us=PULSE_US)
    who = RigName(rig_id=RIG_ID, name="guarded", simulated=False, baseline_m=0.2)
    return Rig(who, clock=clock, mirrors=mirrors, cameras=(wide, left, right), head=head)


if __name__ == "__main__":
    setattr(first_services, "open_rig", guarded_rig)  # noqa: B010 - mypy refuses to assign a function
    program.main()
