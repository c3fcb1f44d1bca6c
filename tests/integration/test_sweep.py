"""The sweep on the simulated rig: measured well and soon, resumed, and by hand."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.marker_room import EYES, RecordingWatcher, changed_room, gaze_error_px, make_grey
from tests.support.scenes.small_sweeps import PLAN, SETTINGS, WIDE, station, sweep

from foveacam_hardware.contract import (
    Cancelled,
    InvalidInput,
    PanTilt,
    Role,
)
from foveacam_hardware.drivers.positioners.manual import ManualPanTilt
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.calibrate.sweep.base_turn import HandTurnedBase
from foveacam_pipeline.calibrate.sweep.marker_target import locate_target
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep, save_sweep
from foveacam_pipeline.calibrate.sweep.sweep_plan import base_pose
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

F_PX = 28_760.0
KNOCKED_AT = 5


@pytest.fixture(scope="module")
def plain_room(tmp_path_factory: pytest.TempPathFactory) -> str:
    return changed_room(tmp_path_factory.mktemp("plain"), plain=True)


@pytest.fixture
def rig(plain_room: str) -> Iterator[Rig]:
    with open_simulated(plain_room, inline=True) as opened:
        make_grey(opened)
        yield opened


@dataclass(frozen=True, kw_only=True)
class Swept:
    """A station that was swept, who watched, and how long it took; `kept`: when it was cancelled before."""

    rig: Rig
    at: str
    folder: Path
    whole: Sweep
    watch: RecordingWatcher
    elapsed_s: float
    kept: Sweep | None = None


@pytest.fixture(scope="module")
def near(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Swept]:
    """The near station, among textured walls, in colour and binned, swept in one go."""
    folder, watch, at = tmp_path_factory.mktemp("near"), RecordingWatcher(), "markers near"
    with open_simulated("calibration", inline=True) as rig:
        bin_cameras(rig, 2)
        start_ns = rig.clock.now_ns()
        whole = sweep(rig, folder, watch, at=at)
        elapsed_s = 1e-9 * (rig.clock.now_ns() - start_ns)
        yield Swept(rig=rig, at=at, folder=folder, whole=whole, watch=watch, elapsed_s=elapsed_s)


@pytest.fixture(scope="module")
def far(plain_room: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Swept]:
    """The far station, at full size, cancelled after three poses and gone on with."""
    folder, watch, at = tmp_path_factory.mktemp("far"), RecordingWatcher(), "markers"
    with open_simulated(plain_room, inline=True) as rig:
        make_grey(rig)
        start_ns = rig.clock.now_ns()
        impatient = RecordingWatcher(enough=lambda notes: any(done == 3 for done, _, _ in notes.notes))
        with pytest.raises(Cancelled, match="what was measured is kept"):
            sweep(rig, folder, impatient, at=at)
        kept = load_sweep(folder / sweep_filename(station(rig, at)))
        whole = sweep(rig, folder, watch, at=at)
        elapsed_s = 1e-9 * (rig.clock.now_ns() - start_ns)
        yield Swept(rig=rig, at=at, folder=folder, whole=whole, watch=watch, elapsed_s=elapsed_s, kept=kept)


@pytest.fixture(params=["near", "far"])
def swept(request: pytest.FixtureRequest) -> Swept:
    found: Swept = request.getfixturevalue(request.param)
    return found


def test_every_pose_is_measured_to_a_fraction_of_a_pixel(swept: Swept) -> None:
    found = swept.whole
    assert found.complete
    assert swept.elapsed_s < 40.0  # 9 poses, the visits between them, homing, the way there, the first looks
    for role in EYES:
        assert len(found.accepted(role)) == 9
        eyes = [(pose, pose.eye(role)) for pose in found.poses]
        assert np.mean([eye.looks for _, eye in eyes if eye is not None]) <= 2.5
        errors = [
            gaze_error_px(swept.rig, role, eye, locate_target(pose.wide, SETTINGS.layout, WIDE), F_PX)
            for pose, eye in eyes
            if eye is not None
        ]
        # Wide corners of 0.009 px are 0.08 fovea px; the mounts drift by some tenths of a pixel meanwhile.
        assert np.abs(np.array(errors)).max() < 0.9
        assert np.array(errors).std(axis=0).max() < 0.3
    assert swept.watch.notes[-1][:2] == (9, 9)
    assert "pose 9 of 9" in swept.watch.notes[-1][2]
    on_file = load_sweep(swept.folder / sweep_filename(station(swept.rig, swept.at)))
    assert [pose.t_ns for pose in on_file.poses] == [pose.t_ns for pose in found.poses]


def test_what_every_camera_sees_is_shown(near: Swept) -> None:
    assert set(near.watch.shown) == {"wide", "left", "right"}
    assert near.watch.last["wide"].shape == (540, 720, 3)


def test_a_cancelled_sweep_keeps_what_it_has_and_goes_on_from_there(far: Swept) -> None:
    kept, whole = far.kept, far.whole
    assert kept is not None
    assert len(kept.poses) == 3
    assert [pose.t_ns for pose in whole.poses[:3]] == [pose.t_ns for pose in kept.poses]
    told = [done for done, total, _ in far.watch.notes if total == 9]
    assert min(told) == told[0] == 3  # also while it only begins again: the time left follows from it
    visits = [(pose.index, pose.repeat) for pose in whole.repeats]
    assert visits == [(4, 1), (4, 2), (4, 3)]  # before the first, before it went on, after the last
    assert [pose.t_ns for pose in whole.repeats[:1]] == [pose.t_ns for pose in kept.repeats]
    assert load_sweep(far.folder / "sweep-markers.jsonl").repeats[-1].t_ns == whole.repeats[-1].t_ns


def test_a_rig_that_is_knocked_amid_a_sweep_is_swept_to_the_end(rig: Rig, tmp_path: Path) -> None:
    """Both mounts turn by 0.3 deg: from the second pose after it on all is expected where it is."""
    assert rig.truth is not None
    bin_cameras(rig, 2)
    faults = rig.truth.world.faults

    def knock(notes: RecordingWatcher) -> bool:
        if any(done == KNOCKED_AT for done, _, _ in notes.notes):
            faults.drift_step_rad = {Role.LEFT: (0.005, -0.002, 0.0017), Role.RIGHT: (-0.003, -0.004, 0.0)}
        return False

    whole = sweep(rig, tmp_path, RecordingWatcher(enough=knock), plan=replace(PLAN, columns=4))

    looks = [eye.looks for pose in whole.poses for eye in (pose.left, pose.right) if eye is not None]
    assert len(looks) == 2 * 12  # none was refused
    assert np.mean(looks) < 2.0


def test_a_sweep_does_not_go_on_with_another_plan_and_moves_nothing(far: Swept) -> None:
    before, before_ns = (far.folder / "sweep-markers.jsonl").read_bytes(), far.rig.clock.now_ns()

    with pytest.raises(InvalidInput, match=r"begun with plan \d+ x \d+ over ±.* now it is \d+ x \d+ over"):
        sweep(far.rig, far.folder, plan=replace(PLAN, columns=5))

    assert (far.folder / "sweep-markers.jsonl").read_bytes() == before
    assert far.rig.clock.now_ns() == before_ns


def test_the_target_appears_where_the_plan_wants_it_however_crooked_the_base_stands(swept: Swept) -> None:
    assert len(swept.whole.poses) > 1
    for pose in swept.whole.poses[1:]:
        middle = locate_target(pose.wide, SETTINGS.layout, WIDE).middle_m
        seen: NDArray[np.float64] = np.arctan(middle[:2] / middle[2])
        # The base's axes lean by up to 0.3 deg and its pivots lie 6 cm from the camera: 1 deg at 5 m.
        assert np.abs(seen - np.array(pose.node_rad)).max() < math.radians(0.15)
        assert pose.pan_tilt is not None
        stand = station(swept.rig, swept.at)
        assert stand.distance_m is not None
        planned = base_pose(np.array(pose.node_rad), stand.pose)
        aside_rad = math.radians(5.0 / stand.distance_m)
        assert pose.pan_tilt.pan_rad == pytest.approx(planned.pan_rad, abs=aside_rad)


class Operator(RecordingWatcher):
    """Turns the rig by hand to whatever bearing is wanted, a little beside it."""

    def __init__(self, rig: Rig, wanted: ManualPanTilt) -> None:
        super().__init__()
        assert rig.pan_tilt is not None
        self._motors: PanTilt = rig.pan_tilt
        self._wanted = wanted
        self._turned_to: object = None

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        super().progress(done, total=total, note=note)
        pose = self._wanted.wanted
        if pose is not None and pose != self._turned_to and not self._motors.state.moving:
            self._turned_to = pose
            aside = math.radians(0.3)
            self._motors.move_to(replace(pose, pan_rad=pose.pan_rad + aside, tilt_rad=pose.tilt_rad - aside))


def turned_by_hand(rig: Rig) -> tuple[ManualPanTilt, Operator]:
    """Return what a rig without motors is, and who turns it."""
    assert rig.pan_tilt is not None
    rig.pan_tilt.home()
    while rig.pan_tilt.state.moving:
        rig.clock.sleep_until_ns(rig.clock.now_ns() + 10_000_000)
    by_hand = ManualPanTilt()
    by_hand.connect()
    return by_hand, Operator(rig, by_hand)


def test_a_rig_turned_by_hand_is_measured_where_it_rests(rig: Rig, far: Swept, tmp_path: Path) -> None:
    missing = {0}
    known = replace(far.whole, poses=tuple(pose for pose in far.whole.poses if pose.index not in missing))
    save_sweep(known, tmp_path / "sweep-markers.jsonl")
    by_hand, watch = turned_by_hand(rig)

    found = sweep(rig, tmp_path, watch, pan_tilt=by_hand)

    assert found.complete
    fresh = [pose for pose in found.poses if pose.index in missing]
    assert all(pose.left is not None and pose.right is not None for pose in fresh)
    assert all(pose.pan_tilt is None for pose in fresh)
    wanted = [note for _, _, note in watch.notes if note.startswith("wanted: the target at (-6.00°, -5.00°)")]
    assert any("turn the rig" in note and "to the right" in note for note in wanted)


def test_who_is_asked_to_turn_the_rig_has_time_to_begin(rig: Rig) -> None:
    by_hand, watch = turned_by_hand(rig)
    turning = replace(SETTINGS.turning, begin_ms=600.0)
    turned = HandTurnedBase(
        head=rig.head, clock=rig.clock, watch=watch, wide=WIDE, layout=SETTINGS.layout, settings=turning
    )
    at = station(rig)
    rest, next_to_it = np.zeros(2), np.deg2rad([0.4, 0.4])
    asked_ns = rig.clock.now_ns()
    assert turned.wait_for(np.array([rest, next_to_it]), done=0, total=2) == 0
    untouched_s = 1e-9 * (rig.clock.now_ns() - asked_ns)

    by_hand.move_to(base_pose(np.deg2rad([3.0, 0.0]), at.pose))
    far_off = np.deg2rad([[3.0, 0.0], [0.4, 0.4]])

    assert 0.6 <= untouched_s < 1.2
    assert turned.wait_for(far_off, done=1, total=2) == 0  # not what it rested next to before it was turned
