"""A still on devices that take their time only: stacks where the mirrors stand, and cameras that stall."""

import errno
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.devices.small_stub_rig import small_stub_rig
from tests.support.scenes.dataset_scenes import CALIBRATION

from foveacam_bench.capture.stub_rig import StubRig
from foveacam_hardware.contract import (
    Cancelled,
    DeviceFault,
    Frame,
    InvalidInput,
    MirrorVolts,
    NotConnected,
    OutOfRange,
    Role,
    StereoVolts,
    StorageFull,
)
from foveacam_pipeline.capture.dataset import Dataset, DatasetState, ImageCodec, check_dataset
from foveacam_pipeline.capture.plan import ImageSize
from foveacam_pipeline.capture.run.shots import StackMean
from foveacam_pipeline.capture.still import (
    Still,
    StillKeep,
    StillLabels,
    StillPlan,
    check_still_room,
    still_bytes,
    take_still,
    write_still,
)

STANDS = StereoVolts(left=MirrorVolts(x_v=21.0, y_v=-4.0), right=MirrorVolts(x_v=-17.0, y_v=-4.0))


@dataclass
class Watch:
    """Cancels, or does something to the rig, once so many frames came."""

    then: Callable[[int], bool] = lambda _: False
    seen: list[Frame] = field(default_factory=list)
    over: bool = False

    def progress(self, done: int, *, total: int, note: str) -> None:
        assert done <= total
        self.over = self.then(done)

    def cancelled(self) -> bool:
        return self.over

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        self.seen += frames


@pytest.fixture
def stub_rig() -> StubRig:
    found = small_stub_rig()
    found.mirrors.steer(STANDS)
    return found


def taken(rig: StubRig, watch: Watch | None = None, **plan: object) -> Still:
    return take_still(rig, StillPlan(**plan), watch=watch or Watch())  # type: ignore[arg-type]  # of a plan


def counts(still: Still) -> dict[Role, int]:
    return {role: sum(each.role is role for each in still.exposures) for role in Role}


def test_a_press_takes_a_stack_of_every_camera_and_moves_no_mirror(stub_rig: StubRig) -> None:
    still = taken(stub_rig, frames=4)

    assert counts(still) == dict.fromkeys(Role, 4)
    assert stub_rig.mirrors.volts == STANDS
    assert {each.volts_v for each in still.exposures if each.role is Role.LEFT} == {(21.0, -4.0)}
    assert len({(each.role, each.t_ns) for each in still.exposures}) == 12  # no frame stands twice in a stack
    assert still.missing == ()
    assert still.missing_error(kept="") is None


def test_a_slow_wide_camera_is_waited_for_and_no_frame_of_it_counts_twice() -> None:
    still = taken(small_stub_rig(wide_hz=5.0), frames=3, roles=(Role.WIDE,))
    times_ns = [each.t_ns for each in still.exposures]
    assert len(set(times_ns)) == 3


def test_the_mean_of_a_stack_lies_in_the_middle_of_its_times_and_volts() -> None:
    frames = [
        Frame(
            image=np.full((2, 3), level, dtype=np.uint8), role=Role.LEFT, seq=k, t_ns=1000 * k, exposure_ns=1
        ).with_volts(MirrorVolts(x_v=x_v, y_v=-2.0 * x_v), frame_id=k)
        for k, (level, x_v) in enumerate([(10, 1.0), (20, 2.0), (60, 6.0)])
    ]
    stack = StackMean(frames[0])
    for frame in frames[1:]:
        stack.add(frame)
    mean = stack.frame()
    assert (mean.volts, mean.t_ns) == (MirrorVolts(x_v=3.0, y_v=-6.0), 1000)
    assert (mean.image == 30 << 8).all()


def test_a_stack_is_a_mean_of_16_bits_and_a_single_frame_stays_as_it_came(stub_rig: StubRig) -> None:
    mean, one = taken(stub_rig, frames=3), taken(stub_rig, frames=1)

    assert [(shot.frame.bits, shot.frame.image.dtype.name) for shot in mean.shots] == [(16, "uint16")] * 3
    assert np.array_equal(mean.shots[1].frame.image, stub_rig.left.image.astype(np.uint16) << 8)
    assert [(shot.frame.bits, shot.frame.image.dtype.name) for shot in one.shots] == [(8, "uint8")] * 3


def test_a_still_is_a_dataset_of_one_point_that_says_all_of_itself(stub_rig: StubRig, tmp_path: Path) -> None:
    still = taken(stub_rig, frames=3, keep=StillKeep.ALL)
    write_still(
        tmp_path / "a", still, CALIBRATION, StillLabels(label="a desk", codec=ImageCodec.PNG, id="still-1")
    )
    dataset = Dataset.open(tmp_path / "a")
    header, point = dataset.document.header, dataset[0]

    assert check_dataset(tmp_path / "a") == []
    assert (dataset.document.state, header.id, header.label) == (DatasetState.COMPLETE, "still-1", "a desk")
    assert header.plan["format"] == "foveacam-still"
    exposures = header.conditions["exposures"]
    assert isinstance(exposures, list)
    assert len(exposures) == 9
    assert (len(point.frames), point.stacked(Role.RIGHT).bits) == (9, 16)
    assert point.pose.volts == STANDS
    assert point.pose.left_rad == pytest.approx(CALIBRATION.left.mirror.angles_rad(STANDS.left))
    assert point.place.distance_m == pytest.approx(CALIBRATION.meeting(STANDS).point_m[2])


def test_without_a_calibration_the_volts_are_kept_and_no_angle_is_made_up(
    stub_rig: StubRig, tmp_path: Path
) -> None:
    write_still(tmp_path / "a", taken(stub_rig, frames=2), None, StillLabels())
    point = Dataset.open(tmp_path / "a")[0]

    assert (point.pose.volts, point.pose.left_rad, point.place.distance_m) == (STANDS, None, None)


def test_a_camera_that_stalls_is_named_with_its_count_and_costs_the_others_nothing(
    stub_rig: StubRig, tmp_path: Path
) -> None:
    def stall(done: int) -> bool:
        stub_rig.right.lost = 99 if done >= 6 else 0
        return False

    still = taken(stub_rig, Watch(then=stall), frames=5)
    write_still(tmp_path / "a", still, CALIBRATION, StillLabels())

    assert counts(still) == {Role.WIDE: 5, Role.LEFT: 5, Role.RIGHT: 2}
    trouble = still.missing_error(kept="what came is held")
    assert isinstance(trouble, DeviceFault)
    assert "camera right: 2 of 5 frames came" in str(trouble)
    assert "check its cables" in str(trouble.remedy)
    assert {shot.frame.role for shot in still.shots} == set(Role)  # two frames are worth their mean
    assert Dataset.open(tmp_path / "a").document.header.conditions["missing"] != []
    assert check_dataset(tmp_path / "a") == []


def test_a_frame_that_is_lost_now_and_then_is_taken_again(stub_rig: StubRig) -> None:
    stub_rig.left.lost = 2

    assert counts(taken(stub_rig, frames=3)) == dict.fromkeys(Role, 3)


def test_a_camera_that_is_gone_is_not_waited_for(stub_rig: StubRig) -> None:
    stub_rig.left.failure = NotConnected("camera left: it is gone; plug it in")
    still = taken(stub_rig, frames=2)

    assert counts(still) == {Role.WIDE: 2, Role.LEFT: 0, Role.RIGHT: 2}
    assert still.missing[0].remedy == "plug it in"
    assert len([what for _, what in stub_rig.did if what.startswith("begin")]) == 2


class Odd(DeviceFault):
    """What a driver may raise: an error of the contract, made otherwise."""

    def __init__(self, why: str) -> None:
        super().__init__(f"controller: {why}; check the strobe cables")


def test_mirrors_that_cannot_trigger_leave_the_wide_view(stub_rig: StubRig) -> None:
    stub_rig.mirrors.failure = Odd("no strobe")
    still = taken(stub_rig, frames=2)

    assert counts(still) == {Role.WIDE: 2, Role.LEFT: 0, Role.RIGHT: 0}
    assert "camera left: 0 of 2" in str(still.missing_error(kept="held"))
    assert "camera right: 0 of 2" in str(still.missing_error(kept="held"))


def test_where_nothing_came_there_is_no_still(stub_rig: StubRig) -> None:
    stub_rig.left.failure = NotConnected("camera left: it is gone; plug it in")
    with pytest.raises(NotConnected, match="camera left: 0 of 5 frames came"):
        taken(stub_rig, roles=(Role.LEFT,))


def test_the_wide_camera_alone_triggers_nothing(stub_rig: StubRig) -> None:
    still = taken(stub_rig, frames=3, roles=(Role.WIDE,))

    assert counts(still) == {Role.WIDE: 3, Role.LEFT: 0, Role.RIGHT: 0}
    assert stub_rig.did == []


def test_pictures_of_another_size_are_not_averaged(stub_rig: StubRig) -> None:
    def crop(done: int) -> bool:
        stub_rig.left.image = stub_rig.left.image[:4]
        return False

    still = taken(stub_rig, Watch(then=crop), frames=3)

    assert counts(still)[Role.LEFT] == 1
    assert "changed their size" in str(still.missing_error(kept=""))


def test_a_cancelled_still_is_nothing(stub_rig: StubRig) -> None:
    with pytest.raises(Cancelled):
        taken(stub_rig, Watch(then=lambda done: done >= 3), frames=8)


@pytest.mark.parametrize("frames", [0, -1, 65])
def test_a_stack_that_no_press_takes_is_refused(frames: int) -> None:
    with pytest.raises(OutOfRange, match="1 to 64"):
        StillPlan(frames=frames)


@pytest.mark.parametrize("roles", [(), (Role.LEFT, Role.LEFT)])
def test_cameras_are_named_once_each(roles: tuple[Role, ...]) -> None:
    with pytest.raises(InvalidInput, match="each once"):
        StillPlan(roles=roles)


def test_a_still_too_large_for_memory_or_disk_is_refused_with_both_figures() -> None:
    size = ImageSize(width=1440, height=1080, channels=3, bits=12)
    needed = still_bytes(StillPlan(frames=64, keep=StillKeep.ALL), fovea=size, wide=size)

    assert needed == 3 * 64 * 1440 * 1080 * 3 * 2
    with pytest.raises(OutOfRange, match=r"1\.79 GB, at most 1\.07 GB"):
        check_still_room(needed, free_bytes=10**12)
    mean = still_bytes(StillPlan(frames=64), fovea=replace(size, bits=8), wide=size)
    with pytest.raises(OutOfRange, match=r"up to 565 MB, .*; 50 MB"):
        check_still_room(mean, free_bytes=50_000_000)


def test_a_still_that_a_full_disk_does_not_take_leaves_no_folder(
    stub_rig: StubRig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, content: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    still = taken(stub_rig, frames=1)
    monkeypatch.setattr("foveacam_pipeline.capture.dataset.point_store.write_part", full)
    with pytest.raises(StorageFull, match=r"the disk is full .* then take the still again"):
        write_still(tmp_path / "a", still, CALIBRATION, StillLabels())
    assert not (tmp_path / "a").exists()
