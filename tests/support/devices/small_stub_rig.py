"""The stub rig of captures and stills, with pictures of a few pixels."""

from foveacam_bench.capture.stub_rig import StubRig
from foveacam_hardware.contract import VirtualClock
from tests.support.scenes.dataset_scenes import CALIBRATION


def small_stub_rig(*, wide_hz: float = 100.0) -> StubRig:
    return StubRig(
        VirtualClock(10**9),
        rig_id=CALIBRATION.rig_id,
        settle_us=14_000,
        exposure_ns=5_000_000,
        size=(6, 8),
        wide_hz=wide_hz,
    )
