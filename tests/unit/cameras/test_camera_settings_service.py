"""The service of camera settings on two foveae of plain Python: both are changed, or neither."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.devices.fake_rig import FakeCamera
from tests.support.devices.hardware_setup import PATIENCE_S, HardwareSetup, hardware_setup

from foveacam_hardware.contract import (
    CameraRanges,
    CameraSettings,
    Clock,
    Frame,
    OutOfRange,
    Role,
    ValueRange,
)
from foveacam_server.resources.devices.cameras.changes import FOVEAE, CameraChange
from foveacam_server.resources.devices.cameras.records import CameraRecords
from foveacam_server.resources.devices.cameras.service import CameraSettingsService

LEFT_NS, RIGHT_NS = ValueRange(low=1e6, high=20e6), ValueRange(low=2e6, high=12e6)


class Fovea(FakeCamera):
    """Keeps its settings, refuses any gain if told to, and gives pictures of one grey level."""

    def __init__(self, role: Role, clock: Clock, *, exposure_ns: ValueRange) -> None:
        super().__init__(role, clock)
        self._exposure_ns = exposure_ns
        self.refuses_gain = False
        self.level = 128

    @property
    def ranges(self) -> CameraRanges:
        return replace(super().ranges, exposure_ns=self._exposure_ns)

    def configure(self, settings: CameraSettings) -> CameraSettings:
        if self.refuses_gain and settings.gain_db:
            raise OutOfRange(f"camera {self.role}: {settings.gain_db:g} dB is too much; choose less")
        self.settings = settings
        return settings

    def read(self, *, timeout_ms: float = 1000.0) -> Frame:
        frame = super().read(timeout_ms=timeout_ms)
        return replace(frame, image=np.full_like(frame.image, self.level))


class Pair:
    """A hardware thread on two such foveae, and the service that changes them."""

    def __init__(self, setup: HardwareSetup, folder: Path) -> None:
        self.left = Fovea(Role.LEFT, setup.clock, exposure_ns=LEFT_NS)
        self.right = Fovea(Role.RIGHT, setup.clock, exposure_ns=RIGHT_NS)
        setup.rig.left, setup.rig.right = self.left, self.right
        self.head = setup.rig.head
        self.hardware = setup.start()
        self.records = CameraRecords(folder)
        self.service = CameraSettingsService(self.records, events=setup.events)


@pytest.fixture
def pair(tmp_path: Path) -> Iterator[Pair]:
    with hardware_setup(tmp_path / "data") as setup:
        yield Pair(setup, tmp_path / "cameras")


def test_a_change_of_both_foveae_that_the_second_refuses_is_undone_in_the_first(pair: Pair) -> None:
    before = pair.left.settings
    pair.right.refuses_gain = True

    with pytest.raises(OutOfRange, match="camera right: 5 dB is too much"):
        pair.service.change(pair.hardware, FOVEAE, CameraChange(gain_db=5.0)).result(PATIENCE_S)

    assert pair.left.settings == before
    assert pair.records.get(pair.left.info.serial) is None


@pytest.mark.parametrize(("level", "limit_ns"), [(1, RIGHT_NS.high), (255, RIGHT_NS.low)])
def test_one_exposure_of_both_foveae_is_sought_within_the_ranges_of_both(
    pair: Pair, level: int, limit_ns: float
) -> None:
    pair.left.level = pair.right.level = level

    found = pair.service.find_pair_exposure(pair.hardware)

    tried_ns = [exposure_ns for exposure_ns, _ in pair.head.exposures]
    assert found.exposure_ns == tried_ns[-1] == limit_ns
    assert all(RIGHT_NS.low <= exposure_ns <= RIGHT_NS.high for exposure_ns in tried_ns)
