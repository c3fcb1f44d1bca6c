"""The times of a capture's steps bound the duration of the next, on devices and a disk of known speed."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest
from tests.support.scenes.dataset_scenes import CALIBRATION

from foveacam_bench.capture.stub_rig import StubRig
from foveacam_hardware.contract import Cancelled, Frame, VirtualClock
from foveacam_pipeline.capture.dataset import DatasetHeader, DatasetWriter, ImageCodec
from foveacam_pipeline.capture.plan import RasterPlan, fill_in_plan, plan_from
from foveacam_pipeline.capture.run import CapturePhase, CaptureReport, CaptureRig, PaceMeter
from foveacam_server.datasets.capture_paces import CapturePaces
from foveacam_server.datasets.capture_tools import rig_facts
from foveacam_server.resources.capturing.captures.estimates import PlanToEstimate, estimate_plan
from foveacam_server.resources.capturing.captures.schema import EstimateDocument
from foveacam_server.resources.capturing.captures.timed_run import run_timed

T = TypeVar("T")

FIXATION_NS, SHOT_NS, SURVEYED = 1_200_000_000, 230_000_000, 9


class SlowRig(StubRig):
    """A rig whose every shot keeps a computer busy for as long as rendering it would."""

    busy_ns = SHOT_NS

    def run_moving(self, work: Callable[[CaptureRig], T]) -> T:
        found = super().run_moving(work)
        self.clock.sleep_until_ns(self.clock.now_ns() + self.busy_ns)
        return found


class Watch:
    """A watcher that cancels after some points."""

    def __init__(self, *, most: int = 10_000) -> None:
        self._most, self._done = most, 0

    def progress(self, report: CaptureReport) -> None:
        self._done = report.done if report.phase is CapturePhase.POINTS else 0

    def cancelled(self) -> bool:
        return self._done >= self._most

    def paused(self) -> bool:
        return False

    def ask_operator(self, request: str) -> None:
        raise Cancelled(request)

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        return


@pytest.fixture
def rig() -> SlowRig:
    clock = VirtualClock(10**9)
    return SlowRig(
        clock,
        rig_id=CALIBRATION.rig_id,
        settle_us=14_000,
        exposure_ns=5_000_000,
        size=(6, 8),
        wide_hz=30.0,
    )


def square(columns: int) -> RasterPlan:
    grid = {"kind": "grid", "columns": columns, "rows": columns}
    verging = {"mode": "given", "distance_m": 4.0}
    return fill_in_plan(plan_from({"points": grid, "verging": verging, "wide": "scan"}), CALIBRATION)


def captured_s(rig: SlowRig, folder: Path, columns: int, *, most: int = 10_000) -> float:
    """Capture a square after a survey of nine fixations; return how long both took."""
    begin_ns = rig.clock.now_ns()
    meter = PaceMeter(Watch(most=most), clock=rig.clock)
    for number in range(SURVEYED):
        meter.progress(CaptureReport(phase=CapturePhase.SURVEY, done=number, total=SURVEYED))
        rig.clock.sleep_until_ns(rig.clock.now_ns() + FIXATION_NS)
    plan = square(columns)
    header = DatasetHeader(
        points=columns * columns,
        plan=plan.model_dump(mode="json"),
        rig={"rig_id": rig.rig_id},
        calibration=CALIBRATION,
    )
    with DatasetWriter.create(folder / f"{columns}", header) as writer:
        run_timed(rig, writer, meter, CapturePaces(folder))
    return (rig.clock.now_ns() - begin_ns) / 1e9


def estimated(rig: SlowRig, folder: Path, columns: int) -> EstimateDocument:
    return estimate_plan(
        PlanToEstimate(
            plan=square(columns),
            calibration=CALIBRATION,
            facts=rig.run_still(rig_facts),
            codec=ImageCodec.TIFF,
            folder=folder,
            runs=CapturePaces(folder).of(rig.rig_id),
            surveyed=SURVEYED,
        )
    )


def test_the_estimate_after_9_points_holds_the_duration_of_81(rig: SlowRig, tmp_path: Path) -> None:
    captured_s(rig, tmp_path, 3)
    found = estimated(rig, tmp_path, 9)
    took_s = captured_s(rig, tmp_path, 9)

    assert took_s == pytest.approx(9 * 1.2 + 81 * 0.25, abs=2.0)
    assert found.duration_low_s < took_s < found.duration_high_s
    assert found.preparing_low_s < 9 * 1.2 < found.preparing_high_s
    assert (found.timed_captures, found.preparing_fixations) == (1, SURVEYED)
    assert found.total_s < 4.0  # the least that physics allows, as before


def test_the_first_estimate_is_assumed_and_holds_it_too(rig: SlowRig, tmp_path: Path) -> None:
    found = estimated(rig, tmp_path, 3)
    assert found.timed_captures == 0
    assert found.duration_low_s < captured_s(rig, tmp_path, 3) < found.duration_high_s


def test_a_busier_computer_widens_the_range(rig: SlowRig, tmp_path: Path) -> None:
    captured_s(rig, tmp_path, 3)
    quiet = estimated(rig, tmp_path, 9)
    rig.busy_ns *= 4
    captured_s(rig, tmp_path, 4)
    both = estimated(rig, tmp_path, 9)
    assert both.duration_low_s == pytest.approx(quiet.duration_low_s, rel=0.01)
    assert both.duration_high_s > 2.0 * quiet.duration_high_s
    assert both.timed_captures == 2


def test_a_cancelled_capture_keeps_no_times(rig: SlowRig, tmp_path: Path) -> None:
    with pytest.raises(Cancelled):
        captured_s(rig, tmp_path, 3, most=4)
    assert CapturePaces(tmp_path).of(rig.rig_id) == ()
