"""The wide context belongs to one rig, calibration and pose; it comes back after a restart."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION

from foveacam_hardware.contract import DeviceInfo, PanTiltLimits, PanTiltPose, PanTiltState, RailState
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.wide_depth.values import DepthSource
from foveacam_server.resources.looking.wide_depth.context_keeper import ContextKeeper
from foveacam_server.rig.status import PanTiltStatus, RigStatus

POINT = DepthSamples(tangents=np.zeros((1, 2)), inverse_z_per_m=np.array([0.2]), sigma_per_m=np.array([1e-3]))


@dataclass
class Room:
    calibration: Calibration | None
    status: RigStatus


@pytest.fixture
def room() -> Room:
    rail = RailState(connected=True, homed=True, position_m=0.1)
    return Room(calibration=CALIBRATION, status=RigStatus(rig_id="sim", rail=rail))


def _keeper(folder: Path, room: Room) -> ContextKeeper:
    return ContextKeeper(folder, calibration=lambda: room.calibration, status=lambda: room.status)


def _known(keeper: ContextKeeper) -> int:
    context = keeper.present()
    return -1 if context is None else len(context.samples())


def _measure(keeper: ContextKeeper) -> None:
    context = keeper.present()
    assert context is not None
    context.fuse(POINT, source=DepthSource.FIXATION)


def test_there_is_none_before_the_rig_is_known_and_calibrated(tmp_path: Path, room: Room) -> None:
    keeper = _keeper(tmp_path, room)
    assert _known(keeper) == 0
    room.calibration = None
    assert _known(keeper) == -1
    room.calibration, room.status = CALIBRATION, RigStatus()
    assert _known(keeper) == -1


def test_another_calibration_begins_with_nothing(tmp_path: Path, room: Room) -> None:
    keeper = _keeper(tmp_path, room)
    _measure(keeper)
    room.calibration = replace(CALIBRATION, label="another")
    assert _known(keeper) == 0


def test_a_rig_that_was_moved_along_its_rail_begins_with_nothing(tmp_path: Path, room: Room) -> None:
    keeper = _keeper(tmp_path, room)
    _measure(keeper)
    room.status = replace(room.status, rail=RailState(connected=True, homed=True, position_m=0.1004))
    assert _known(keeper) == 1  # less than a step: it trembles
    room.status = replace(room.status, rail=RailState(connected=True, homed=True, position_m=0.15))
    assert _known(keeper) == 0


def test_a_rig_that_turns_has_none_until_it_stands(tmp_path: Path, room: Room) -> None:
    def turned(pan_rad: float, *, moving: bool) -> RigStatus:
        state = PanTiltState(
            connected=True, moving=moving, homed=True, pose=PanTiltPose(pan_rad=pan_rad, tilt_rad=0.0)
        )
        info = DeviceInfo(vendor="maker", model="turntable", serial="1")
        limits = PanTiltLimits(pan_min_rad=-1.0, pan_max_rad=1.0, tilt_min_rad=-1.0, tilt_max_rad=1.0)
        status = PanTiltStatus(info=info, limits=limits, moves_itself=True, state=state)
        return replace(room.status, pan_tilt=status)

    keeper = _keeper(tmp_path, room)
    room.status = turned(0.0, moving=False)
    _measure(keeper)
    room.status = turned(0.05, moving=True)
    assert _known(keeper) == -1
    room.status = turned(0.1, moving=False)
    assert _known(keeper) == 0


def test_what_is_known_comes_back_after_a_restart_at_the_same_place(tmp_path: Path, room: Room) -> None:
    keeper = _keeper(tmp_path, room)
    _measure(keeper)
    keeper.save()
    assert _known(_keeper(tmp_path, room)) == 1
    room.status = replace(room.status, rail=RailState(connected=True, homed=True, position_m=0.3))
    assert _known(_keeper(tmp_path, room)) == 0


def test_what_was_forgotten_does_not_come_back(tmp_path: Path, room: Room) -> None:
    keeper = _keeper(tmp_path, room)
    _measure(keeper)
    keeper.save()
    keeper.forget()
    assert _known(keeper) == 0
    assert _known(_keeper(tmp_path, room)) == 0


def test_a_damaged_file_is_as_good_as_none(tmp_path: Path, room: Room) -> None:
    (tmp_path / "context.npz").write_bytes(b"PK\x03\x04 cut off")
    assert _known(_keeper(tmp_path, room)) == 0
