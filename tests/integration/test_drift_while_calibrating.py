"""Mounts that drift while the simulated rig is calibrated: seen, taken out, and closed before the check."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.marker_room import EYES, changed_room, make_grey, true_wide

from foveacam_hardware.contract import Role
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.calibrate.fit.measured import NominalRig, reduce_sweeps
from foveacam_pipeline.calibrate.records.aggregate import sweep_paths
from foveacam_pipeline.calibrate.sweep.sweep import Sweep
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_pipeline.calibrate.sweep.sweep_reference import middle_node, nodes_to_return_to
from foveacam_pipeline.models import Calibration
from foveacam_server.resources.calibrating.sessions.drift_step import close_drift
from foveacam_server.resources.calibrating.sessions.fit_step import compute_fit
from foveacam_server.resources.calibrating.sessions.mirrors_step import measure_mirrors
from foveacam_server.resources.calibrating.sessions.options import FitOptions, MirrorsOptions
from foveacam_server.resources.calibrating.sessions.sessions import (
    DRIFT,
    CalibrationSession,
    SessionCollection,
)
from foveacam_server.resources.calibrating.sessions.step_environment import SilentStepWatcher, environment_of

pytestmark = pytest.mark.timeout(300)

F_PX = 28_760.0
FASTER = 12.0
WAIT_S = 60.0
SIDE = 4
EXTENT_DEG = 5.0
"""Nodes across and down: a cubic needs 30 of both stations, and so few decide over a small field."""
WIDE = true_wide()


class Kept:
    """Calibrations by their id."""

    def __init__(self) -> None:
        self.known: dict[str, Calibration] = {}

    def add(self, calibration: Calibration) -> None:
        self.known[calibration.id] = calibration

    def get(self, calibration_id: str) -> Calibration:
        return self.known[calibration_id]

    def activate(self, calibration_id: str) -> Calibration:
        return self.known[calibration_id]


@dataclass(frozen=True)
class Swept:
    """A rig whose mounts drift fast, and the session in which its mirrors were swept."""

    rig: Rig
    session: CalibrationSession

    @property
    def sweeps(self) -> list[Sweep]:
        return [load_sweep(path) for path in sweep_paths(self.session.folder)]

    def true_turn(self, role: Role, t_s: float) -> NDArray[np.float64]:
        assert self.rig.truth is not None
        world = self.rig.truth.world
        return world.drift.turn_rad(role, t_s - 1e-9 * world.t0_ns)

    def measure(self) -> None:
        options = MirrorsOptions(nodes=[SIDE, SIDE], extent_ax_deg=EXTENT_DEG, extent_ay_deg=EXTENT_DEG)
        measure_mirrors(
            self.session, options, WIDE, environment=environment_of(self.rig), watch=SilentStepWatcher()
        )


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Swept]:
    room = changed_room(tmp_path_factory.mktemp("room"), plain=True)
    with open_simulated(room, seed=7, inline=True) as rig:
        assert rig.truth is not None
        make_grey(rig)
        rig.truth.world.drift.amplitude_rad *= FASTER
        rig.mirrors.enable()
        shelf = SessionCollection(tmp_path_factory.mktemp("data"))
        session = shelf.create(label="hot", rig_id=rig.rig_id, baseline_m=rig.baseline_m)
        found = Swept(rig, session)
        found.measure()
        yield found


def test_the_middle_is_visited_during_each_sweep_and_the_first_station_after_the_last(swept: Swept) -> None:
    near, far = sorted(swept.sweeps, key=lambda sweep: sweep.header.station.distance_m or math.inf)
    middle = middle_node(near.header.plan)
    assert {pose.index for pose in near.repeats} == {middle}
    assert {pose.index for pose in far.repeats} > {middle}
    back = [pose for pose in far.repeats if pose.t_ns > max(pose.t_ns for pose in near.poses)]
    assert {pose.index for pose in back} == set(nodes_to_return_to(far)) >= {5, 6, 9, 10}
    assert len({pose.run for sweep in (near, far) for pose in (*sweep.poses, *sweep.repeats)}) == 1


def test_what_is_complete_is_not_measured_again(swept: Swept) -> None:
    before = {path: path.read_bytes() for path in sweep_paths(swept.session.folder)}
    before_ns = swept.rig.clock.now_ns()
    swept.measure()
    assert swept.rig.clock.now_ns() == before_ns
    assert {path: path.read_bytes() for path in sweep_paths(swept.session.folder)} == before


def test_the_drift_that_was_measured_is_the_true_one(swept: Swept) -> None:
    found = reduce_sweeps(swept.sweeps, WIDE, drawing=NominalRig(rig_id=swept.rig.rig_id), label="hot")
    assert found.drift is not None
    for role in EYES:
        (run,) = found.drift[role].runs
        end = swept.true_turn(role, float(run.knots_s[-1]))
        true = np.array([swept.true_turn(role, t_s) - end for t_s in run.knots_s.tolist()])
        # 0.06 px a pose, few of which decide at either end
        assert np.abs(run.turn_rad[:, :2] - true).max() < 0.3 / F_PX
        assert np.abs(true).max() > 0.6 / F_PX


def test_what_drifts_between_the_sweep_and_the_check_is_taken_out(swept: Swept) -> None:
    options, kept = FitOptions(compare=False), Kept()
    fitted = compute_fit(swept.session, options, WIDE).calibration
    kept.add(fitted)
    clock = swept.rig.clock
    clock.sleep_until_ns(clock.now_ns() + round(WAIT_S * 1e9))
    last_s = max(1e-9 * pose.t_ns for sweep in swept.sweeps for pose in sweep.repeats)

    closed = close_drift(
        swept.session,
        fitted,
        options,
        environment=environment_of(swept.rig),
        registry=kept,
        watch=SilentStepWatcher(),
    )

    assert closed.parent_id == fitted.id
    assert swept.session.head.calibrations[-1] == closed.id
    found = swept.session.read(DRIFT)
    assert found is not None
    assert found.corrected
    now_s = 1e-9 * clock.now_ns()
    for role in EYES:
        x_rad, y_rad = swept.true_turn(role, now_s) - swept.true_turn(role, last_s)
        moved = closed.eye(role).mirror.angles_of(np.zeros((1, 2))) - fitted.eye(role).mirror.angles_of(
            np.zeros((1, 2))
        )
        # the coarse grid's model misses its nodes by about a px, five of which decide
        assert moved[0] == pytest.approx([y_rad, -x_rad], abs=1.0 / F_PX)
