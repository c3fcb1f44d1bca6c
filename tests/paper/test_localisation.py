"""Fig. 4 on the simulated rig: the scene is the experiment's, and both pairs localise the figurine."""

from itertools import count

import numpy as np
import pytest

from foveacam_hardware.contract import Cancelled, Role
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.scenes.format import StatueObject
from foveacam_hardware.sim.scenes.loader import load_scene
from foveacam_pipeline.study.localisation.accuracy import aligned
from foveacam_pipeline.study.localisation.experiment import ExperimentPlan, Pair, run_experiment, slide_to
from foveacam_pipeline.study.localisation.rail import CENTRE, FOOT_Y_M, SCENE, slots, targets_m
from foveacam_pipeline.workers.progress import SILENT, SilentProgress
from foveacam_server.resources.studying.studies.simulated_rigs import FigurineStage, rail_rig

STANDOFF_M = 10.0
PLAN = ExperimentPlan(standoffs_m=(STANDOFF_M,), slots=2, trials=1)


@pytest.fixture(scope="module", autouse=True)
def _renderer() -> None:
    warm_up()


class Impatient(SilentProgress):
    """Cancels after so many steps."""

    def __init__(self, steps: int) -> None:
        self._asked = count(1)
        self._steps = steps

    def cancelled(self) -> bool:
        """Return whether the last step was that one."""
        return next(self._asked) >= self._steps


def test_the_targets_of_the_design_are_on_the_figurines_chest() -> None:
    with open_simulated(SCENE, inline=True) as rig:
        assert rig.truth is not None
        stage = FigurineStage(rig.truth.world.animated_scene)
        for standoff_m in (5.0, 15.0):
            stage.set_standoff(standoff_m)
            for position in (CENTRE, *slots(2)):
                stage.place(position)
                target_m = position.target_m(standoff_m)
                x_px, y_px = rig.truth.wide_pixels(np.array([target_m]))[0].tolist()
                seen = rig.truth.depth_at(x_px, y_px, rig.clock.now_ns())
                assert seen is not None
                assert seen.name == "figurine"
                # the line of sight meets folds of the chest a little beside the target
                assert seen.point_rig_m == pytest.approx(target_m, abs=5e-4)


def test_the_figurine_of_the_scene_stands_on_its_rail() -> None:
    scene = load_scene(SCENE)
    (figurine,) = (thing for thing in scene.objects if isinstance(thing, StatueObject))
    assert figurine.position_m == CENTRE.foot_m(5.0)
    rail = next(thing for thing in scene.objects if thing.name == "rail")
    assert rail.position_m[1] > FOOT_Y_M


def test_both_pairs_localise_the_figurine() -> None:
    with rail_rig() as rig:
        record = run_experiment(rig, PLAN, watch=SILENT)
        assert rig.stage.state.position_m == pytest.approx(rig.calibration.baseline_m / 2.0, abs=1e-4)
    assert record.complete
    truth_m = targets_m(PLAN.positions, STANDOFF_M)
    wide_m, fovea_m = (
        np.abs(aligned(record.points_m(pair, STANDOFF_M), truth_m) - truth_m).max()
        for pair in (Pair.WIDE, Pair.FOVEA)
    )
    wide_bound_m, fovea_bound_m = (
        STANDOFF_M**2 / (f_px * 0.2) * record.bounds_px[pair, STANDOFF_M]
        for pair, f_px in ((Pair.WIDE, 3155.0), (Pair.FOVEA, 28_760.0))
    )
    assert fovea_bound_m < wide_bound_m / 9.0, "nine times finer, and of finer texture"
    assert fovea_m < 10.0 * fovea_bound_m
    assert wide_m < 10.0 * wide_bound_m
    found = record.points_m(Pair.FOVEA, STANDOFF_M)
    sigma_m = rig.calibration.pose_sigma_px(STANDOFF_M) * STANDOFF_M**2 / (28_760.0 * 0.2)
    assert np.abs(found - truth_m).max() < 3.0 * sigma_m
    assert record.scene is not None
    assert record.scene.left.role is Role.LEFT


def test_a_cancelled_experiment_keeps_its_complete_runs() -> None:
    with rail_rig() as rig:
        record = run_experiment(rig, PLAN, watch=Impatient(2))
    assert not record.complete
    assert len(record.estimates) == 2
    assert len(record.points_m(Pair.FOVEA, STANDOFF_M)) == 1
    assert len(record.points_m(Pair.WIDE, STANDOFF_M)) == 0


def test_a_cancelled_experiment_without_a_complete_run_has_no_result() -> None:
    with rail_rig() as rig, pytest.raises(Cancelled, match="run it again"):
        run_experiment(rig, PLAN, watch=Impatient(1))


def test_the_stage_is_homed_before_its_first_move() -> None:
    with rail_rig() as rig:
        before = rig.stage.state
        slide_to(rig.stage, rig.clock, -0.1)
        assert (before.homed, rig.stage.state.homed) == (False, True)
        assert rig.stage.state.position_m == pytest.approx(-0.1, abs=1e-4)
