"""The trigger pulse that the head chooses suits the controller for every exposure in use."""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from foveacam_hardware.contract import PARKED
from foveacam_hardware.drivers.triggered_head import TriggeredHead
from foveacam_hardware.rig import Rig
from foveacam_hardware.rig_config import SimulatedRigConfig
from foveacam_hardware.sim.cables import TRIGGER_TO_EXPOSURE_US
from foveacam_hardware.sim.rig import simulated_rig


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with simulated_rig(SimulatedRigConfig(strict=True), inline=True) as opened:
        opened.connect()
        yield opened


@pytest.mark.parametrize("exposure_ms", [0.1, 1.0, 4.0, 8.33, 10.0, 20.0, 100.0])
def test_frames_of_every_exposure_succeed_again_and_again(rig: Rig, exposure_ms: float) -> None:
    head = rig.head
    assert isinstance(head, TriggeredHead)
    for camera in (rig.left, rig.right):
        camera.configure(replace(camera.settings, exposure_ns=round(exposure_ms * 1e6), triggered=True))

    receipts = [rig.mirrors.expose(PARKED, settle_us=1000, pulse_us=head._pulse_us()) for _ in range(3)]

    for receipt in receipts:
        late_ns = receipt.t_exposure_start_ns - receipt.t_trigger_ns
        assert late_ns == pytest.approx(TRIGGER_TO_EXPOSURE_US * 1000, abs=2000)
