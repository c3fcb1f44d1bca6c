"""The fit as a step of a session: what it keeps, what it tells, and what it refuses."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import pytest
from tests.support.scenes.swept_rig import SweptRig, swept, wide_lens

from foveacam_hardware.contract import Cancelled, NotCalibrated
from foveacam_pipeline.calibrate.fit.fit import FULL_FIT_PARTS
from foveacam_pipeline.calibrate.sweep.sweep import sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import save_sweep
from foveacam_pipeline.calibrate.watcher import SilentWatcher
from foveacam_pipeline.models import Calibration, Intrinsics
from foveacam_server.resources.calibrating.sessions.descriptions import describe_session
from foveacam_server.resources.calibrating.sessions.fit_step import earlier_fit, fit_session
from foveacam_server.resources.calibrating.sessions.options import FitOptions
from foveacam_server.resources.calibrating.sessions.sessions import CalibrationSession, SessionCollection

pytestmark = pytest.mark.slow

SEED = 5
SIDE = 6
DISTANCES_M = (5.0, 2.5)


@dataclass
class Kept:
    """The rig's calibrations, in memory."""

    known: dict[str, Calibration] = field(default_factory=dict)

    def add(self, calibration: Calibration) -> None:
        self.known[calibration.id] = calibration

    def get(self, calibration_id: str) -> Calibration:
        return self.known[calibration_id]

    def activate(self, calibration_id: str) -> Calibration:
        raise AssertionError(f"nobody asked to put {calibration_id} in force")


@dataclass
class RecordedSteps(SilentWatcher):
    """What a step told."""

    stages: list[str] = field(default_factory=list)
    fits: list[str] = field(default_factory=list)
    last: tuple[int, int] = (0, 0)

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        self.last = (done, total)

    def stage(self, name: str) -> None:
        self.stages.append(name)

    def sample(self, sample_id: str) -> None:
        raise AssertionError(sample_id)

    def pose(self, station: str, *, index: int, left: str, right: str) -> None:
        raise AssertionError(station)

    def fitted(self, calibration: Calibration) -> None:
        self.fits.append(calibration.id)


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CalibrationSession]:
    """A session that holds two sweeps."""
    sweeps = [swept(SEED, distance_m, side=SIDE) for distance_m in DISTANCES_M]
    shelf = SessionCollection(tmp_path_factory.mktemp("sessions"))
    made = shelf.create(label="spring", rig_id=sweeps[0].header.rig_id, baseline_m=0.2)
    for sweep in sweeps:
        save_sweep(sweep, made.folder / sweep_filename(sweep.header.station))
    yield made


@dataclass
class RecordedPolls(RecordedSteps):
    """Notes how far the fit was whenever it asked whether to go on."""

    asked: list[tuple[int, int]] = field(default_factory=list)

    def cancelled(self) -> bool:
        self.asked.append(self.last)
        return False


@cache
def lens() -> Intrinsics:
    return wide_lens(SweptRig(SEED))


def test_fit_is_kept_told_and_drawn_and_asks_often_whether_to_go_on(session: CalibrationSession) -> None:
    kept, watch = Kept(), RecordedPolls()
    calibration = fit_session(session, FitOptions(compare=False), lens(), registry=kept, watch=watch)
    assert kept.known == {calibration.id: calibration}
    assert (calibration.origin, calibration.label, calibration.session_id) == (
        "measured",
        "spring",
        session.id,
    )
    assert watch.stages == ["fit"]
    assert watch.fits == [calibration.id]
    assert watch.last[0] == watch.last[1] > 0
    assert len(watch.asked) >= 10
    assert len(set(watch.asked)) >= len(watch.asked) // 2  # between pieces of work
    found = describe_session(session, url="/s", running=None)
    assert found.fit is not None
    assert found.calibrations[-1] == found.fit.calibration_id == calibration.id
    assert {model.eye for model in found.fit.models if model.chosen} == {"left", "right"}
    assert set(found.fit.parallax or {}) == {f"markers at {distance_m:g} m" for distance_m in DISTANCES_M}
    assert found.fit.volts_roundtrip_max_lsb <= 1.0
    assert earlier_fit(session, FitOptions(compare=False), lens(), registry=kept) == calibration
    assert earlier_fit(session, FitOptions(compare=False, order=3), lens(), registry=kept) is None
    other = replace(lens(), fx_px=3000.0)
    assert earlier_fit(session, FitOptions(compare=False), other, registry=kept) is None
    drawn = {picture.name for picture in found.pictures}
    assert {"quiver_left", "quiver_right", "loo", "warp_left", "warp_right"} <= drawn


def test_fit_of_one_distance_and_one_order_does_what_it_was_told(session: CalibrationSession) -> None:
    kept, watch = Kept(), RecordedSteps()
    options = FitOptions(compare=False, order=3, use_all_distances=False, label="plain")
    calibration = fit_session(session, options, lens(), registry=kept, watch=watch)
    assert calibration.label == "plain"
    fit = describe_session(session, url="/s", running=None).fit
    assert fit is not None
    assert {model.order for model in fit.models} == {3}
    assert set(fit.parallax or {}) == {"markers at 5 m"}
    assert session.head.calibrations[-1] == calibration.id


def test_session_without_a_sweep_says_which_step_comes_first(tmp_path: Path) -> None:
    empty = SessionCollection(tmp_path).create(label="empty", rig_id="rig-1", baseline_m=0.2)
    with pytest.raises(NotCalibrated, match="run the step mirrors first"):
        fit_session(empty, FitOptions(), lens(), registry=Kept(), watch=RecordedSteps())
    assert empty.empty


@dataclass
class Impatient(RecordedSteps):
    """Wants no more once so much is done."""

    patience: int = 0

    def cancelled(self) -> bool:
        return self.last[0] >= self.patience


@pytest.mark.parametrize(
    ("compare", "patience"),
    [(True, 0), (True, FULL_FIT_PARTS), (False, FULL_FIT_PARTS + 3)],
    ids=["before it begins", "while models are compared", "while pictures are drawn"],
)
def test_cancelled_fit_leaves_nothing_behind(
    session: CalibrationSession, compare: bool, patience: int
) -> None:
    kept, impatient = Kept(), Impatient(patience=patience)
    before = {path: path.read_bytes() for path in session.folder.rglob("*") if path.is_file()}
    with pytest.raises(Cancelled, match="the fit was cancelled"):
        fit_session(session, FitOptions(compare=compare), lens(), registry=kept, watch=impatient)
    assert kept.known == {}
    assert impatient.fits == []
    assert {path: path.read_bytes() for path in session.folder.rglob("*") if path.is_file()} == before
