"""Measure the accuracy of a calibration made by the procedures alone, on a simulated rig of another seed.

All three stages run in virtual time, as in `foveacam calibrate all`. The simulation's truth then judges 200
poses that were not measured, with the mounts' drift at the end of the sweeps. Finally the mounts are knocked
and the calibration is corrected.
"""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from foveacam_bench.calibration.truth import (
    CalibrationModel,
    JudgedModel,
    TruthAtMoment,
    judge,
    pointing_errors_px,
    random_poses,
)
from foveacam_bench.figures import Figures, Report
from foveacam_bench.judging import rms
from foveacam_hardware.contract import PARKED, Binning, DeviceFault, NotCalibrated, Role
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.truth import Truth
from foveacam_pipeline.calibrate.drift.check import run_drift_check
from foveacam_pipeline.calibrate.drift.correction import correct_calibration
from foveacam_pipeline.models import Calibration
from foveacam_pipeline.models.mirror import DAC_STEP_V
from foveacam_server.resources.calibrating.sessions.fit_step import compute_fit
from foveacam_server.resources.calibrating.sessions.mirrors_step import measure_mirrors
from foveacam_server.resources.calibrating.sessions.options import FitOptions, MirrorsOptions, WideOptions
from foveacam_server.resources.calibrating.sessions.sessions import SessionCollection
from foveacam_server.resources.calibrating.sessions.step_environment import SilentStepWatcher, environment_of
from foveacam_server.resources.calibrating.sessions.turning import turn_to_station
from foveacam_server.resources.calibrating.sessions.wide_stage import lens_of
from foveacam_server.resources.calibrating.sessions.wide_step import measure_wide
from foveacam_server.resources.studying.studies.click_truth import truth_of

SEED = 4_711
JUDGE_SEED = 99
POSES, QUICK_POSES = 200, 16
QUICK_NODES, QUICK_VIEWS = [5, 5], 6
"""Of the sweeps, and of the board; a whole run takes as many as a calibration does."""
SHIFT_DEG, ROLL_DEG = 0.3, 0.1
ROUND_TRIPS = 2_000


@dataclass(slots=True)
class StageTimer:
    """Times each stage, by the rig's clock, by the wall clock and by the processor's time."""

    rig: Rig
    report: Report = lambda progress: None
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Time a stage."""
        self.report(stage)
        rig_ns, wall_s, cpu_s = self.rig.clock.now_ns(), time.perf_counter(), time.process_time()
        yield
        self.seconds[f"{stage}_simulated_s"] = round((self.rig.clock.now_ns() - rig_ns) / 1e9, 1)
        self.seconds[f"{stage}_wall_s"] = round(time.perf_counter() - wall_s, 1)
        self.seconds[f"{stage}_cpu_s"] = round(time.process_time() - cpu_s, 1)


def run(
    *,
    quick: bool = False,
    seed: int = SEED,
    preset: str = "rig120",
    binning: Binning = 2,
    report: Report = lambda progress: None,
) -> Figures:
    """Calibrate a rig, judge it, knock it, correct it; `quick`: fewer views, a coarser sweep, fewer poses.

    `binning`: the rig's working binning, at which the sweeps are measured.
    """
    poses = QUICK_POSES if quick else POSES
    with (
        TemporaryDirectory() as folder,
        open_simulated("calibration", preset=preset, seed=seed, inline=True) as rig,
    ):
        truth = truth_of(rig)
        rig.working_binning = binning
        rig.mirrors.enable()
        watch = StageTimer(rig, report)
        calibration, paper = calibrate_rig(rig, Path(folder), quick=quick, watch=watch)
        report("comparing with the truth")
        at_sweep_end = TruthAtMoment(truth, rig.clock.now_ns())
        ours = judge(CalibrationModel(calibration), at_sweep_end, seed=JUDGE_SEED, count=poses)
        plain = {} if paper is None else judge(paper, at_sweep_end, seed=JUDGE_SEED, count=poses)
        return {
            **ours,
            **{f"paper_{name}": value for name, value in plain.items() if name != "poses"},
            "wide_rms_px": wide_rms_px(calibration, truth),
            "volts_roundtrip_max_lsb": roundtrip_lsb(calibration),
            "mirror_orders": [calibration.eye(role).mirror.forward.order for role in (Role.LEFT, Role.RIGHT)],
            **drift_figures(rig, calibration, truth, count=poses),
            **watch.seconds,
        }


def calibrate_rig(
    rig: Rig, folder: Path, *, watch: StageTimer, quick: bool = False, label: str = "bench"
) -> tuple[Calibration, JudgedModel | None]:
    """Run all three stages as an operator would; return our calibration and the paper's model."""
    nodes, views = (QUICK_NODES, QUICK_VIEWS) if quick else (None, None)
    session = SessionCollection(folder).create(label=label, rig_id=rig.rig_id, baseline_m=rig.baseline_m)
    environment, silent = environment_of(rig), SilentStepWatcher()
    with watch.timed("wide"):
        measure_wide(session, WideOptions(views=views), environment=environment, watch=silent)
    lens = lens_of(session)
    with watch.timed("sweep"):
        measure_mirrors(session, MirrorsOptions(nodes=nodes), lens, environment=environment, watch=silent)
    with watch.timed("fit"):
        result = compute_fit(session, FitOptions(label=label, compare=False), lens)
    return result.calibration, result.paper


def wide_rms_px(calibration: Calibration, truth: Truth) -> float:
    """Return the rms distance of wide pixels from where the calibrate_rig lens projects their true rays."""
    rng = np.random.default_rng(JUDGE_SEED)
    size = (calibration.wide.width - 0.5, calibration.wide.height - 0.5)
    pixels = rng.uniform((-0.5, -0.5), size, (1_000, 2))
    rays = truth.wide_rays(pixels)
    found = calibration.wide.pixels(np.arctan(rays[:, :2] / rays[:, 2:]))
    return rms(np.linalg.norm(found - pixels, axis=1))


def roundtrip_lsb(calibration: Calibration) -> float:
    """Return the largest error of volts -> angles -> volts, in DAC steps."""
    rng = np.random.default_rng(JUDGE_SEED)
    largest = 0.0
    for role in (Role.LEFT, Role.RIGHT):
        mirror = calibration.eye(role).mirror
        volts = rng.uniform(-1.0, 1.0, (ROUND_TRIPS, 2)) * np.array(mirror.max_v)
        angles = mirror.angles_of(volts)
        inside = mirror.inside(angles)
        back = mirror.volts_for(angles[inside])
        largest = max(largest, float(np.abs(back - volts[inside]).max()) / DAC_STEP_V)
    return largest


def drift_figures(rig: Rig, calibration: Calibration, truth: Truth, *, count: int) -> dict[str, float]:
    """Knock both eyes' mounts, correct by one drift check at the markers, and judge open-loop pointing."""
    rng = np.random.default_rng(JUDGE_SEED)
    for role, heading in zip((Role.LEFT, Role.RIGHT), rng.uniform(0.0, 2.0 * math.pi, 2), strict=True):
        shift = math.radians(SHIFT_DEG)
        roll = math.copysign(math.radians(ROLL_DEG), 1.0 if role is Role.LEFT else -1.0)
        truth.world.faults.drift_step_rad[role] = (
            shift * math.sin(heading),
            shift * math.cos(heading),
            roll,
        )
    station = next(station for station in rig.stations if station.name == "markers")
    if rig.pan_tilt is None:
        raise DeviceFault("bench calibration: the simulated rig came without its pan-tilt")
    turn_to_station(rig.pan_tilt, station, clock=rig.clock, watch=SilentStepWatcher())
    rig.head.look(PARKED)
    before = _pointing_rms_px(calibration, truth, count=count, t_ns=rig.clock.now_ns())
    began_ns = rig.clock.now_ns()
    found = run_drift_check(rig.head, calibration, clock=rig.clock)
    lasted_s = (rig.clock.now_ns() - began_ns) / 1e9
    if not found.significant:
        raise NotCalibrated(f"bench calibration: the knock was not noticed: {found.detail}")
    corrected = correct_calibration(
        calibration, found, created_utc=datetime.now(tz=UTC).isoformat(timespec="seconds")
    )
    again = run_drift_check(rig.head, corrected, clock=rig.clock)
    return {
        "pointing_before_drift_shot_rms_px": before,
        "pointing_after_drift_rms_px": _pointing_rms_px(
            corrected, truth, count=count, t_ns=rig.clock.now_ns()
        ),
        "drift_shot_simulated_s": round(lasted_s, 2),
        "drift_looks": found.looks,
        "drift_second_shot_significant": again.significant,
    }


def _pointing_rms_px(calibration: Calibration, truth: Truth, *, count: int, t_ns: int) -> float:
    rng = np.random.default_rng(JUDGE_SEED)
    poses = random_poses(CalibrationModel(calibration), truth, rng=rng, count=count)
    return rms(np.linalg.norm(pointing_errors_px(truth, poses, t_ns=t_ns), axis=2))
