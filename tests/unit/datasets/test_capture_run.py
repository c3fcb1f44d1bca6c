"""The procedure of a capture on devices that take their time only, on a virtual clock."""

import errno
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.support.devices.stub_rail import StubRail
from tests.support.scenes.dataset_scenes import CALIBRATION

from foveacam_bench.capture.stub_rig import READOUT_NS, StubRig
from foveacam_hardware.contract import (
    Cancelled,
    DeviceFault,
    Frame,
    NotConnected,
    OutOfRange,
    Role,
    StorageFull,
    VirtualClock,
)
from foveacam_pipeline.capture.dataset import (
    Dataset,
    DatasetHeader,
    DatasetState,
    DatasetWriter,
    check_dataset,
)
from foveacam_pipeline.capture.plan import (
    RasterPlan,
    fill_in_plan,
    plan_from,
    point_volts,
    points_of_plan,
    shot_limit_ms,
)
from foveacam_pipeline.capture.run import CapturePhase, CaptureReport, RunSettings, prepare_plan, run_capture
from foveacam_pipeline.storage.disk import write_part

SETTLE_US, EXPOSURE_NS = 14_000, 5_000_000
LINE_MS = 0.004
"""Cameras expose whole lines."""
GIVEN: dict[str, Any] = {"verging": {"mode": "given", "distance_m": 4.0}}


def plan_of(columns: int = 2, rows: int = 2, **more: Any) -> RasterPlan:  # noqa: ANN401 - JSON values
    grid = {"kind": "grid", "columns": columns, "rows": rows}
    return fill_in_plan(plan_from({**GIVEN, "points": grid, **more}), CALIBRATION)


@dataclass
class Watch:
    """Cancels once `enough` says so; counts what it was told."""

    enough: Callable[[CaptureReport], bool] = lambda _: False
    reports: list[CaptureReport] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    seen: list[Frame] = field(default_factory=list)
    pauses: int = 0
    """So many questions are answered with yes."""
    over: bool = False

    def progress(self, report: CaptureReport) -> None:
        self.reports.append(report)
        self.over = self.over or self.enough(report)

    def cancelled(self) -> bool:
        return self.over

    def paused(self) -> bool:
        self.pauses -= 1
        return self.pauses >= 0

    def ask_operator(self, request: str) -> None:
        self.asked.append(request)
        self.pauses = 3

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        self.seen += frames


@pytest.fixture
def stub_rig() -> StubRig:
    return StubRig(
        VirtualClock(10**9),
        rig_id=CALIBRATION.rig_id,
        settle_us=SETTLE_US,
        exposure_ns=EXPOSURE_NS,
        size=(6, 8),
        wide_hz=200.0,
    )


@contextmanager
def writing(folder: Path, plan: RasterPlan) -> Iterator[DatasetWriter]:
    total = plan.scans * plan.points_per_scan
    header = DatasetHeader(points=total, plan=plan.model_dump(mode="json"), calibration=CALIBRATION)
    fresh = not folder.exists()
    with DatasetWriter.create(folder, header) if fresh else DatasetWriter.resume(folder) as writer:
        yield writer


def captured(rig: StubRig, folder: Path, plan: RasterPlan, watch: Watch | None = None) -> Dataset:
    with writing(folder, plan) as writer:
        run_capture(rig, writer, watch=watch or Watch())
    return Dataset.open(folder)


def happened(rig: StubRig, *words: str) -> list[str]:
    return [what for _, what in rig.did if what.startswith(words)]


def test_a_capture_takes_every_point_with_its_volts_and_a_wide_frame(
    stub_rig: StubRig, tmp_path: Path
) -> None:
    plan = plan_of()
    dataset = captured(stub_rig, tmp_path / "a", plan)

    assert check_dataset(tmp_path / "a") == []
    assert dataset.document.state is DatasetState.COMPLETE
    assert [(point.place.column, point.place.row) for point in dataset] == [(0, 0), (1, 0), (1, 1), (0, 1)]
    for taken, planned in zip(dataset, points_of_plan(plan), strict=True):
        volts = taken.pose.volts
        assert volts is not None
        assert volts.left.x_v == pytest.approx(point_volts(planned, CALIBRATION).left.x_v)
        assert volts.right.y_v == pytest.approx(point_volts(planned, CALIBRATION).right.y_v)
        assert {frame.role for frame in taken.frames} == set(Role)


def test_the_mirrors_move_on_while_the_cameras_are_read(stub_rig: StubRig, tmp_path: Path) -> None:
    captured(stub_rig, tmp_path / "a", plan_of(wide="none"))

    order = happened(stub_rig, "begin", "exposed", "left")
    assert order[:6] == [
        "begin 14000 us",
        "exposed",
        "begin 14000 us",
        "left read",
        "exposed",
        "begin 14000 us",
    ]
    assert order[-3:] == ["left read", "exposed", "left read"]
    begun = [t_ns for t_ns, what in stub_rig.did if what.startswith("begin")]
    limit_ms = shot_limit_ms(settle_ms=14.0, readout_ms=READOUT_NS / 1e6, exposure_ms=5.0)
    assert max(np.diff(begun)) / 1e6 <= limit_ms


@pytest.mark.parametrize("exposure_ms", [1, 20, 50, 100])
def test_a_wide_frame_is_not_older_than_its_point(tmp_path: Path, exposure_ms: int) -> None:
    rig = StubRig(
        VirtualClock(10**9),
        rig_id=CALIBRATION.rig_id,
        settle_us=SETTLE_US,
        exposure_ns=exposure_ms * 1_000_000,
        size=(6, 8),
        wide_hz=200.0,
    )
    dataset = captured(rig, tmp_path / "a", plan_of(3, 3))

    for before, point in pairwise(dataset):
        left = before.frame(Role.LEFT)
        assert point.frame(Role.WIDE).t_ns >= left.t_ns + left.exposure_ns // 2


def test_a_fast_mirror_waits_for_the_readout(tmp_path: Path) -> None:
    rig = StubRig(
        VirtualClock(10**9), rig_id=CALIBRATION.rig_id, settle_us=500, exposure_ns=1_000_000, size=(6, 8)
    )
    captured(rig, tmp_path / "a", plan_of(wide="none"))

    begun = [t_ns for t_ns, what in rig.did if what.startswith("begin")]
    assert min(np.diff(begun)) >= READOUT_NS


def test_a_lost_frame_is_taken_again(stub_rig: StubRig, tmp_path: Path) -> None:
    stub_rig.right.lost = 1
    dataset = captured(stub_rig, tmp_path / "a", plan_of())

    assert len(dataset) == 4
    assert check_dataset(tmp_path / "a") == []
    for point in dataset:
        assert point.frame(Role.LEFT).t_ns == point.frame(Role.RIGHT).t_ns


def test_frames_that_do_not_come_end_it_with_a_sentence_and_keep_the_points_before(
    stub_rig: StubRig, tmp_path: Path
) -> None:
    def lose(report: CaptureReport) -> bool:
        stub_rig.right.lost = 99 if report.done >= 2 else 0
        return False

    with pytest.raises(DeviceFault, match=r"tried 3 times .* right.* resume"):
        captured(stub_rig, tmp_path / "a", plan_of(), Watch(enough=lose))

    dataset = Dataset.open(tmp_path / "a")
    assert dataset.document.state is DatasetState.PARTIAL
    assert "tried 3 times" in dataset.document.why
    assert len(dataset) >= 2


def test_a_lost_camera_ends_it_at_once_and_resuming_completes_it(stub_rig: StubRig, tmp_path: Path) -> None:
    def unplug(report: CaptureReport) -> bool:
        stub_rig.left.failure = (
            NotConnected("camera left: it is gone; plug it in") if report.done == 2 else None
        )
        return False

    with pytest.raises(NotConnected, match="plug it in"):
        captured(stub_rig, tmp_path / "a", plan_of(), Watch(enough=unplug))
    stub_rig.left.failure = None

    assert len(captured(stub_rig, tmp_path / "a", plan_of())) == 4
    assert check_dataset(tmp_path / "a") == []


def test_cancelled_and_resumed_it_is_the_same_as_undisturbed(stub_rig: StubRig, tmp_path: Path) -> None:
    plan = plan_of(3, 3)
    with pytest.raises(Cancelled, match="of 9 points"):
        captured(stub_rig, tmp_path / "a", plan, Watch(enough=lambda report: report.done == 4))
    assert Dataset.open(tmp_path / "a").document.state is DatasetState.PARTIAL
    assert len(Dataset.open(tmp_path / "a")) == 4

    again = captured(stub_rig, tmp_path / "a", plan)
    whole = captured(stub_rig, tmp_path / "b", plan)

    assert [(p.index, p.pose.volts) for p in again] == [(p.index, p.pose.volts) for p in whole]


def test_a_pause_lets_time_pass_and_moves_nothing(stub_rig: StubRig, tmp_path: Path) -> None:
    watch = Watch(pauses=40)
    captured(stub_rig, tmp_path / "a", plan_of(), watch)

    assert CapturePhase.PAUSED in {report.phase for report in watch.reports}
    assert stub_rig.did[0][0] >= 10**9 + 39 * 50_000_000
    assert watch.reports[-1].left_s == 0.0
    assert max(report.left_s or 0.0 for report in watch.reports) < 1.0  # not the pause of 2 s


def test_a_bracket_takes_every_exposure_at_every_point_and_puts_the_cameras_back(
    stub_rig: StubRig, tmp_path: Path
) -> None:
    dataset = captured(stub_rig, tmp_path / "a", plan_of(exposures_ms=[2.0, 8.0]))

    for point in dataset:
        taken_ms = [point.frame(Role.LEFT, bracket=b).exposure_ns / 1e6 for b in point.brackets]
        assert taken_ms == pytest.approx([2.0, 8.0], abs=LINE_MS)
    for eye in (stub_rig.left, stub_rig.right):
        assert eye.settings.exposure_ns / 1e6 == pytest.approx(5.0, abs=LINE_MS)
    assert len(happened(stub_rig, "begin 0 us")) == 4  # the second exposure of a point does not settle


def test_an_exposure_of_the_plan_is_set_once_and_disturbs_no_readout(
    stub_rig: StubRig, tmp_path: Path
) -> None:
    captured(stub_rig, tmp_path / "a", plan_of(exposures_ms=[2.0]))

    assert happened(stub_rig, "left exposes") == ["left exposes 2 ms", "left exposes 5 ms"]
    assert len(happened(stub_rig, "begin")) == 4


def test_a_full_disk_ends_it_and_when_there_is_room_it_goes_on(
    stub_rig: StubRig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, content: object) -> None:
        if path.name.startswith("00002"):
            raise OSError(errno.ENOSPC, "No space left on device")
        write_part(path, content)  # type: ignore[arg-type]  # what the store hands over

    with monkeypatch.context() as disk:
        disk.setattr("foveacam_pipeline.capture.dataset.point_store.write_part", full)
        with pytest.raises(StorageFull, match=r"the disk is full .* then resume"):
            captured(stub_rig, tmp_path / "a", plan_of())
    assert [point.index for point in Dataset.open(tmp_path / "a")] == [0, 1]

    captured(stub_rig, tmp_path / "a", plan_of())

    assert check_dataset(tmp_path / "a") == []
    assert Dataset.open(tmp_path / "a").document.state is DatasetState.COMPLETE


def test_a_stack_is_kept_as_its_mean_in_16_bits_or_whole(stub_rig: StubRig, tmp_path: Path) -> None:
    mean = captured(stub_rig, tmp_path / "a", plan_of(stack_frames=4))[0].frame(Role.LEFT)
    every = captured(stub_rig, tmp_path / "b", plan_of(stack_frames=4, stack_keep="all"))[0]

    assert mean.bits == 16
    assert np.array_equal(mean.image, stub_rig.left.image.astype(np.uint16) << 8)
    assert [frame.stack for frame in every.frames if frame.role is Role.LEFT] == [0, 1, 2, 3]


def test_every_place_on_the_rail_is_a_scan_of_its_own(stub_rig: StubRig, tmp_path: Path) -> None:
    stub_rig.rail = StubRail(stub_rig.did, stub_rig.clock)
    dataset = captured(stub_rig, tmp_path / "a", plan_of(rail_positions_mm=[-100.0, 100.0], wide="scan"))

    assert happened(stub_rig, "rail") == ["rail homes", "rail to -100 mm", "rail to 100 mm"]
    assert [(point.place.scan, point.place.rail_m) for point in dataset] == [(0, -0.1)] * 4 + [(1, 0.1)] * 4
    assert [len(point.frames) for point in dataset] == [3, 2, 2, 2, 3, 2, 2, 2]


def test_a_rail_that_stands_elsewhere_ends_it(stub_rig: StubRig, tmp_path: Path) -> None:
    stub_rig.rail = StubRail(stub_rig.did, stub_rig.clock, stuck=True)
    with pytest.raises(DeviceFault, match=r"-100 mm, it stands still at 0\.0 mm"):
        captured(stub_rig, tmp_path / "a", plan_of(rail_positions_mm=[-100.0]))


def test_a_rail_pushed_by_hand_is_asked_for(stub_rig: StubRig, tmp_path: Path) -> None:
    stub_rig.rail = StubRail(stub_rig.did, stub_rig.clock, moves_itself=False)
    watch = Watch()
    dataset = captured(stub_rig, tmp_path / "a", plan_of(rail_positions_mm=[-100.0]), watch)

    assert watch.asked == ["push the rig to -100 mm on the rail, then continue"]
    assert dataset[0].place.rail_m == -0.1


def test_the_cameras_are_put_back_when_it_fails(stub_rig: StubRig, tmp_path: Path) -> None:
    stub_rig.mirrors.failure = NotConnected("controller: it is gone; plug it in")
    with suppress(NotConnected):
        captured(stub_rig, tmp_path / "a", plan_of(exposures_ms=[2.0]))

    assert stub_rig.left.settings.exposure_ns / 1e6 == pytest.approx(5.0, abs=LINE_MS)


def test_what_the_rig_cannot_take_is_refused_before_anything_moves(stub_rig: StubRig) -> None:
    for plan, told in (
        (plan_of(rail_positions_mm=[0.0]), "this rig has no rail"),
        (plan_of(exposures_ms=[5000.0]), "5000 ms"),
    ):
        with pytest.raises(OutOfRange, match=told):
            prepare_plan(stub_rig, plan, CALIBRATION, watch=Watch())
    assert stub_rig.did == []


def test_progress_tells_points_bytes_and_the_time_left(stub_rig: StubRig, tmp_path: Path) -> None:
    watch = Watch()
    with writing(tmp_path / "a", plan_of()) as writer:
        run_capture(stub_rig, writer, watch=watch, settings=RunSettings())

    last = watch.reports[-1]
    assert (last.done, last.total, last.stored, last.left_s) == (4, 4, 4, 0.0)
    assert last.written_bytes > 0
    assert last.bytes_per_s > 0.0
