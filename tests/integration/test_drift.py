"""A relocated rig finds its eyes again: one shot on the simulated rig, judged by its truth."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.marker_room import bench_with, expose_briefly, make_grey
from tests.support.scenes.simulated_gaze import gaze

from foveacam_bench.calibration.truth import EYES, CalibrationModel, random_poses
from foveacam_hardware.contract import Cancelled, Role
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.calibrate.drift.check import run_drift_check
from foveacam_pipeline.calibrate.drift.correction import correct_calibration
from foveacam_pipeline.calibrate.drift.health import HealthMonitor, HealthVerdict
from foveacam_pipeline.calibrate.drift.values import DriftCheck, DriftSettings
from foveacam_pipeline.calibrate.watcher import SilentWatcher
from foveacam_pipeline.models import Calibration, eye_volts, load_calibration
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import PixelTarget
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

CERTIFICATE = load_calibration(SHIPPED / "sim-rig120.json")
RELOCATED = {
    Role.LEFT: tuple(np.deg2rad([0.257, 0.154, -0.1]).tolist()),
    Role.RIGHT: tuple(np.deg2rad([0.095, -0.285, -0.1]).tolist()),
}
"""0.3° of shift, each eye its own way, and 0.1° of roll."""
LATER = "2026-02-01T00:00:00+00:00"
LIMIT_PX = 3.0
LONGEST_S = 10.0
pytestmark = pytest.mark.timeout(300)
FEW = DriftSettings(columns=3, rows=3)
CLICKS = (
    (1000.0, 780.0),
    (640.0, 550.0),
    (870.0, 400.0),
    (900.0, 880.0),
    (930.0, 230.0),
)
"""As many as must tell, on places where both foveae verge."""


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    warm_up()


@contextmanager
def relocated(scene: str) -> Iterator[Rig]:
    with open_simulated(scene, inline=True) as rig:
        assert rig.truth is not None
        rig.truth.world.faults.drift_step_rad = dict(RELOCATED)
        make_grey(rig)
        bin_cameras(rig, 2)
        yield rig


def misses_px(rig: Rig, calibration: Calibration) -> NDArray[np.float64]:
    """Return (n, 2 eyes, 2) how far from where the eyes look 60 targets are, rig axes, fovea px."""
    truth = rig.truth
    assert truth is not None
    misses: list[list[NDArray[np.float64]]] = []
    for pose in random_poses(CalibrationModel(calibration), truth, rng=np.random.default_rng(5), count=60):
        misses.append([])
        for role in EYES:
            view = truth.static_projection(role, eye_volts(pose.volts, role), t_ns=rig.clock.now_ns())
            way, looked = pose.point_rig_m - view.centre_m, gaze(view)
            misses[-1].append(way[:2] / way[2] - looked[:2] / looked[2])
    return calibration.fovea_f_px * np.array(misses)


def pointing_rms_px(misses: NDArray[np.float64]) -> float:
    return math.sqrt(float(np.mean(np.sum(misses**2, axis=2))))


def shoot(rig: Rig, calibration: Calibration, settings: DriftSettings = FEW) -> DriftCheck:
    return run_drift_check(rig.head, calibration, clock=rig.clock, settings=settings)


@dataclass(frozen=True, kw_only=True)
class CheckedRig:
    """A relocated rig before the markers, still open, and the drift check that was run on it."""

    rig: Rig
    before_px: float
    check: DriftCheck


@pytest.fixture(scope="module")
def checked() -> Iterator[CheckedRig]:
    with relocated("calibration") as rig:
        before_px = pointing_rms_px(misses_px(rig, CERTIFICATE))
        yield CheckedRig(rig=rig, before_px=before_px, check=shoot(rig, CERTIFICATE))


def test_one_shot_on_the_markers_restores_both_eyes_and_the_next_finds_nothing(checked: CheckedRig) -> None:
    check = checked.check
    corrected = correct_calibration(CERTIFICATE, check, created_utc=LATER)
    after_px = pointing_rms_px(misses_px(checked.rig, corrected))
    again = shoot(checked.rig, corrected)
    assert checked.before_px > 100.0
    assert check.vergence_known, check.detail
    assert check.duration_s <= LONGEST_S
    assert after_px <= LIMIT_PX, check.detail
    assert again.locked, again.detail
    assert not again.significant, again.detail


def test_without_a_known_depth_all_but_the_angle_between_the_eyes_is_restored(tmp_path: Path) -> None:
    with relocated(bench_with(tmp_path, "back wall")) as rig:
        check = shoot(rig, CERTIFICATE)
        corrected = correct_calibration(CERTIFICATE, check, created_utc=LATER)
        misses = misses_px(rig, corrected)
    assert not check.vergence_known
    common = misses.mean(axis=1)
    assert pointing_rms_px(common[:, None]) <= LIMIT_PX, check.detail
    apart_px = CERTIFICATE.fovea_f_px * (RELOCATED[Role.LEFT][1] - RELOCATED[Role.RIGHT][1])
    assert corrected.pose_sigma_px(8.0) > 0.2 * abs(apart_px)


def test_among_people_that_walk_it_finds_what_stands_still() -> None:
    with relocated("street") as rig:
        expose_briefly(rig)
        check = shoot(rig, CERTIFICATE)
    assert check.locked, check.detail
    for role, turn_rad in RELOCATED.items():
        found = check.eye(role).turn.turn_rad
        assert found[0] == pytest.approx(turn_rad[0], abs=LIMIT_PX / CERTIFICATE.fovea_f_px)
        assert found[2] == pytest.approx(turn_rad[2], abs=math.radians(0.03))


def test_a_slow_machine_is_given_the_time_that_a_lock_takes_and_no_more_than_that_to_none(
    checked: CheckedRig,
) -> None:
    slow = shoot(checked.rig, CERTIFICATE, replace(FEW, timeout_s=0.0))
    slower = shoot(checked.rig, CERTIFICATE, replace(FEW, timeout_s=0.0, longest_s=0.5))
    assert slow.locked, slow.detail
    assert FEW.least_places <= len(slow.places) < len(checked.check.places)
    assert not slower.locked
    assert "No lock: time was up after 1 s" in slower.detail


def test_a_check_can_be_cancelled() -> None:
    class Impatient(SilentWatcher):
        def cancelled(self) -> bool:
            return True

    with open_simulated("calibration", inline=True) as rig, pytest.raises(Cancelled):
        run_drift_check(rig.head, CERTIFICATE, clock=rig.clock, watch=Impatient())


def test_ordinary_fixations_notice_that_an_eye_has_moved(tmp_path: Path) -> None:
    monitor = HealthMonitor(CERTIFICATE)
    with open_simulated(bench_with(tmp_path, "back wall"), inline=True) as rig:
        assert rig.truth is not None
        make_grey(rig)
        bin_cameras(rig, 2)
        rig.truth.world.faults.drift_step_rad = {Role.LEFT: (math.radians(0.02), 0.0, 0.0)}
        for x_px, y_px in CLICKS:
            monitor.add(fixate(rig.head, CERTIFICATE, PixelTarget(x_px=x_px, y_px=y_px), clock=rig.clock))
    assert monitor.health.verdict is HealthVerdict.RECALIBRATE, monitor.health.detail
