"""Results of an experiment by pair and standoff, and its estimates as CSV."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.geometry.triangulate import depth_sigma_m
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.study.localisation.accuracy import TrajectoryErrors, aligned, trajectory_errors
from foveacam_pipeline.study.localisation.experiment import ExperimentRecord, Pair
from foveacam_pipeline.study.localisation.rail import targets_m

_AXES = ("x_m", "y_m", "z_m")
COLUMNS = (
    *("pair", "standoff_m", "trial", "slot"),
    *(f"true_{axis}" for axis in _AXES),
    *_AXES,
    *(f"aligned_{axis}" for axis in _AXES),
    *("disparity_px", "score"),
)
DIGITS = 6
"""Decimals of the table: a micrometre, a millionth of a pixel."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairOutcome:
    """One pair at one standoff: trajectories, errors (None where nothing was found) and what bounds them.

    `points_m`: (trials, slots, 3) rig frame; `truth_m`: (slots, 3). `bound_m`: standard error of the depth by
    the noise of the pictures. `calibration_m`: that by the calibration as it states itself; 0 for the wide
    pair, whose two pictures are of one camera.
    """

    pair: Pair
    standoff_m: float
    points_m: NDArray[np.float64]
    truth_m: NDArray[np.float64]
    errors: TrajectoryErrors | None
    bound_m: float
    calibration_m: float

    @property
    def whole_bound_m(self) -> float:
        """Noise and calibration together, as independent errors."""
        return math.hypot(self.bound_m, self.calibration_m)

    @property
    def key(self) -> str:
        """The distance, as a suffix of the names of values."""
        return f"{self.standoff_m:g}m"


def outcomes(record: ExperimentRecord, calibration: Calibration) -> tuple[PairOutcome, ...]:
    """Return the outcomes of all pairs and standoffs that have at least one complete trial."""
    return tuple(
        _outcome(record, calibration, pair, standoff_m)
        for standoff_m in record.plan.standoffs_m
        for pair in Pair
        if len(record.points_m(pair, standoff_m))
    )


def _outcome(
    record: ExperimentRecord, calibration: Calibration, pair: Pair, standoff_m: float
) -> PairOutcome:
    fovea = pair is Pair.FOVEA
    f_px = calibration.fovea_f_px if fovea else calibration.wide.fx_px
    errors_px = record.bounds_px[pair, standoff_m], calibration.pose_sigma_px(standoff_m) if fovea else 0.0
    bound_m, calibration_m = (
        float(depth_sigma_m(standoff_m, error_px, f_px=f_px, baseline_m=calibration.baseline_m))
        for error_px in errors_px
    )
    points_m, truth_m = record.points_m(pair, standoff_m), targets_m(record.plan.positions, standoff_m)
    return PairOutcome(
        pair=pair,
        standoff_m=standoff_m,
        points_m=points_m,
        truth_m=truth_m,
        errors=trajectory_errors(points_m, truth_m, rng=np.random.default_rng(record.plan.seed)),
        bound_m=bound_m,
        calibration_m=calibration_m,
    )


def estimates_csv(record: ExperimentRecord, found: Sequence[PairOutcome]) -> str:
    """Return every estimate, a line each with the names of `COLUMNS`.

    Cells are empty where a target was not found; aligned positions are given for complete trials.
    """
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(COLUMNS)
    moved = {(one.pair, one.standoff_m): aligned(one.points_m, one.truth_m) for one in found}
    truths = {z_m: targets_m(record.plan.positions, z_m) for z_m in record.plan.standoffs_m}
    for one in sorted(record.estimates, key=lambda one: (one.standoff_m, one.pair, one.trial, one.slot)):
        trials = moved.get((one.pair, one.standoff_m), np.empty((0, 0, 3)))
        point = [math.nan] * 3 if one.found is None else one.found.point_rig_m
        at = trials[one.trial, one.slot] if one.trial < len(trials) else [math.nan] * 3
        match = [math.nan] * 2 if one.found is None else [one.found.disparity_px, one.found.score]
        numbers = [*truths[one.standoff_m][one.slot], *point, *at, *match]
        cells = ["" if math.isnan(number) else f"{number:.{DIGITS}f}" for number in numbers]
        lines.writerow([one.pair.value, f"{one.standoff_m:g}", one.trial, one.slot, *cells])
    return text.getvalue()
