"""A whole calibration that is begun again: what is complete is left out, what is missing is measured."""

import os
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest
from tests.support.scenes.settle_report import REPORT
from tests.support.scenes.swept_rig import SweptRig, swept, wide_lens

from foveacam_hardware.contract import Binning, MarkerPrint, VirtualClock
from foveacam_pipeline.calibrate.settle.settle_report import save_settle
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import save_sweep
from foveacam_pipeline.calibrate.watcher import SilentWatcher
from foveacam_pipeline.calibrate.wide.boards import Charuco
from foveacam_pipeline.calibrate.wide.wide_samples import WideSamples
from foveacam_pipeline.models import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.calibrating.sessions.fit_step import inputs_of
from foveacam_server.resources.calibrating.sessions.mirrors_step import measure_mirrors
from foveacam_server.resources.calibrating.sessions.options import (
    AllOptions,
    BoardOption,
    CheckOptions,
    FitOptions,
    MirrorsOptions,
    WideOptions,
)
from foveacam_server.resources.calibrating.sessions.schema import SettleDocument
from foveacam_server.resources.calibrating.sessions.sessions import (
    FINISHED,
    SETTLE,
    SETTLE_REPORT,
    VIEWS,
    CalibrationSession,
    FinishedCheck,
    FinishedFit,
    FinishedSteps,
    FinishedWide,
    SessionCollection,
)
from foveacam_server.resources.calibrating.sessions.step_environment import ExclusiveRig, StepEnvironment
from foveacam_server.resources.calibrating.sessions.steps import KNOWN, run_all
from foveacam_server.resources.calibrating.sessions.wide_stage import RESULT, WideResult, views_id
from foveacam_server.rig.settle_times import SettleTime

RIG, SEED = "sim-rig120", 0
FAR, NEAR = 5.0, 2.5
CHARUCO = {"kind": "charuco", "columns": 9, "rows": 6, "square_mm": 36.0, "marker_mm": 27.0}
FIT = {
    "model": "five",
    "rms_px": 0.06,
    **dict.fromkeys(("fov_x_deg", "fov_y_deg", "fx_px", "fy_px", "cx_px", "cy_px", "accuracy_deg"), 1.0),
    "distortion": [],
}
STAGE = {
    "samples": [],
    "coverage_fraction": 0.0,
    "tilts_covered": 0,
    "fit": FIT,
    "other_model": None,
    "reason": "the lens was known",
}
STAGES = ["wide", "mirrors", "mirrors", "fit", "check", "settle"]
FITTED = load_calibration(SHIPPED / f"{RIG}.json")


class Touched(Exception):
    """The rig was asked for, and what for."""


@dataclass
class RecordedStages(SilentWatcher):
    """Takes notes."""

    stages: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def stage(self, name: str) -> None:
        self.stages.append(name)

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        assert done == total
        self.notes.append(note)

    def sample(self, sample_id: str) -> None:
        raise AssertionError(sample_id)

    def pose(self, station: str, *, index: int, left: str, right: str) -> None:
        raise AssertionError(station)

    def fitted(self, calibration: Calibration) -> None:
        raise AssertionError(calibration.id)


@dataclass
class Desk:
    """A session, and a rig that nobody may touch."""

    session: CalibrationSession
    recorded: RecordedStages = field(default_factory=RecordedStages)
    waits: list[SettleTime] = field(default_factory=list)
    activated: list[str] = field(default_factory=list)

    def add(self, calibration: Calibration) -> None:
        raise AssertionError(calibration.id)

    def get(self, calibration_id: str) -> Calibration:
        assert calibration_id == FITTED.id
        return FITTED

    def activate(self, calibration_id: str) -> Calibration:
        self.activated.append(calibration_id)
        return FITTED

    @property
    def environment(self) -> StepEnvironment:
        def use(what: str, *, binning: Binning | None = 1) -> AbstractContextManager[ExclusiveRig]:
            raise Touched(what)

        return StepEnvironment(
            rig_id=RIG,
            baseline_m=0.2,
            stations=tuple(sweep.header.station for sweep in SWEEPS),
            clock=VirtualClock(),
            serials={},
            fovea_settings=None,
            max_v=170.0,
            markers=MarkerPrint(),
            use=use,
            wait_after_moves=self.waits.append,
        )

    def run(self, **options: object) -> None:
        asked = AllOptions(activate=True).model_copy(update=options)
        run_all(self.session, asked, environment=self.environment, registry=self, watch=self.recorded)


def returned_to(sweep: Sweep) -> Sweep:
    """Return a sweep after whose end its corners were visited again."""
    corners = [pose for pose in sweep.poses if pose.index in (0, 2, 6, 8)]
    return replace(sweep, repeats=tuple(replace(pose, repeat=1) for pose in corners))


LENS = wide_lens(SweptRig(SEED))
SWEEPS = [swept(SEED, distance_m, side=3) for distance_m in (FAR, NEAR)]


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    """A session in which every step came to its end."""
    session = SessionCollection(tmp_path).create(label="spring", rig_id=RIG, baseline_m=0.2)
    WideSamples(Charuco()).save(session.folder)
    stage = {"board": CHARUCO, "model": None, "lens": LENS, "wide": STAGE}
    session.write(RESULT, WideResult.model_validate({"views_id": views_id(session.folder), **stage}))
    session.finish_steps(FinishedSteps(wide=FinishedWide(views=40)))
    for sweep in SWEEPS:
        save_sweep(returned_to(sweep), session.folder / sweep_filename(sweep.header.station))
    fit = FinishedFit(of=inputs_of(session, FitOptions(), LENS), calibration_id=FITTED.id)
    session.finish_steps(FinishedSteps(fit=fit))
    session.add_calibration(FITTED.id)
    session.finish_steps(FinishedSteps(check=FinishedCheck(calibration_id=FITTED.id, poses=None)))
    save_settle(replace(REPORT, rig_id=RIG), session.folder / SETTLE_REPORT)
    session.write(SETTLE, SettleDocument(axes=[], settle_us=11_200))
    return Desk(session)


def test_nothing_of_a_complete_session_is_measured_again_and_its_results_come_into_force(desk: Desk) -> None:
    before = {path: path.read_bytes() for path in desk.session.folder.rglob("*") if path.is_file()}
    desk.run()
    assert desk.recorded.stages == STAGES
    assert all(note.endswith(KNOWN) for note in desk.recorded.notes)
    assert [time.settle_us for time in desk.waits] == [11_200]
    assert desk.activated == [FITTED.id]
    assert {path: path.read_bytes() for path in desk.session.folder.rglob("*") if path.is_file()} == before


def test_session_that_was_copied_elsewhere_is_as_complete_as_it_was(desk: Desk) -> None:
    for path in desk.session.folder.rglob("*"):
        os.utime(path, ns=(0, path.stat().st_mtime_ns + 1_000_000_000))
    desk.run()
    assert all(note.endswith(KNOWN) for note in desk.recorded.notes)


def forget(desk: Desk, step: str) -> None:
    desk.session.write(FINISHED, desk.session.finished.model_copy(update={step: None}))


def take_another_view(desk: Desk) -> None:
    views = desk.session.folder / VIEWS
    views.write_text(views.read_text() + "\n")


def lose_a_pose(desk: Desk) -> None:
    short = replace(returned_to(SWEEPS[1]), poses=SWEEPS[1].poses[:-1])
    save_sweep(short, desk.session.folder / sweep_filename(short.header.station))


def never_return(desk: Desk) -> None:
    for sweep in SWEEPS:
        save_sweep(sweep, desk.session.folder / sweep_filename(sweep.header.station))


@pytest.mark.parametrize(
    ("lose", "asked"),
    [
        (lambda desk: forget(desk, "wide"), "the calibration of the wide camera"),
        (take_another_view, "the calibration of the wide camera"),
        (lose_a_pose, f"the sweep at {SWEEPS[1].header.station.name}"),
        (never_return, f"the return to {SWEEPS[0].header.station.name}"),
        (lambda desk: forget(desk, "check"), "asking the pan-tilt"),
        (lambda desk: (desk.session.folder / SETTLE.name).unlink(), "the settle characterisation"),
    ],
)
def test_what_is_missing_is_measured_first(desk: Desk, lose: Callable[[Desk], object], asked: str) -> None:
    lose(desk)
    with pytest.raises(Touched, match=asked):
        desk.run()
    assert desk.activated == []


@pytest.mark.parametrize(
    ("options", "asked"),
    [
        ({"wide": WideOptions(views=41)}, "the calibration of the wide camera"),
        ({"wide": WideOptions(model="rational")}, "the calibration of the wide camera"),
        ({"wide": WideOptions(board=BoardOption(square_mm=30.0))}, "the calibration of the wide camera"),
        ({"mirrors": MirrorsOptions(nodes=[5, 5])}, f"the sweep at {SWEEPS[0].header.station.name}"),
        ({"mirrors": MirrorsOptions(restart=True)}, f"the sweep at {SWEEPS[0].header.station.name}"),
        ({"check": CheckOptions(poses=7)}, "asking the pan-tilt"),
    ],
)
def test_what_was_done_otherwise_is_done_again(desk: Desk, options: dict[str, object], asked: str) -> None:
    with pytest.raises(Touched, match=asked):
        desk.run(**options)


def test_what_says_the_same_in_more_words_is_not_done_again(desk: Desk) -> None:
    board = BoardOption(columns=9, rows=6, square_mm=36.0, marker_mm=27.0)
    desk.run(
        wide=WideOptions(views=12, model="five", board=board),
        mirrors=MirrorsOptions(nodes=[3, 3]),
        fit=FitOptions(label="spring"),
    )
    assert desk.activated == [FITTED.id]


def test_poses_that_an_eye_refused_are_tried_again_by_the_step_alone(desk: Desk) -> None:
    sweep = returned_to(SWEEPS[0])
    refused = replace(sweep.poses[4], left=None, left_refusal="blurred")
    poses = (*sweep.poses[:4], refused, *sweep.poses[5:])
    save_sweep(replace(sweep, poses=poses), desk.session.folder / sweep_filename(sweep.header.station))
    desk.run()
    assert desk.activated == [FITTED.id]
    with pytest.raises(Touched, match="the sweep at"):
        measure_mirrors(
            desk.session, MirrorsOptions(), LENS, environment=desk.environment, watch=desk.recorded
        )
