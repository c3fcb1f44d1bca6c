"""Sweeps as the published one: commanded angles and rounded volts of a simulated rig that is imperfect.

The target's turntable errs, which both eyes share; the mirrors scatter and lag as their simulation does; and
what is recorded is rounded.
"""

import json
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_hardware.sim.mirror import FULL_SCALE_CODE, FULL_SCALE_V, NOMINAL_BIAS_V, MirrorPair
from foveacam_hardware.sim.optics import FoldedEye, built_assembly
from foveacam_hardware.sim.presets import RIG120
from foveacam_hardware.simulated_faults import MirrorDisturbance
from foveacam_pipeline.calibrate.fit.sweep_residuals import EyeScan
from tests.support.scenes.simulated_gaze import gaze

EYES = (Role.LEFT, Role.RIGHT)
SIDE = 9
HALF_WIDTH_DEG, HALF_HEIGHT_DEG = 8.9, 7.8
MOVE_NS = 300_000_000
NEWTON_ROUNDS = 5
SweepTable: TypeAlias = dict[str, dict[str, list[list[float]]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class TurntableErrors:
    """Errors of the target's direction, degrees: the same for both eyes, and not in the commanded angles.

    `lag_deg`: shift across and down by the direction of the last pan, half of the difference.
    `line_rms_deg`: of the tilt, one for each line. `position_rms_deg`: of the pan, one for each position in
    the lines.
    """

    lag_deg: tuple[float, float] = (0.0, 0.0)
    line_rms_deg: float = 0.0
    position_rms_deg: float = 0.0


PERFECT_TURNTABLE = TurntableErrors()
REAL_TURNTABLE = TurntableErrors(lag_deg=(-0.025, 0.033), line_rms_deg=0.028, position_rms_deg=0.02)
"""Errors like those of the published sweep, by their shares of its residuals."""
REAL_MIRRORS = MirrorDisturbance(scatter_rms_deg=0.006)
"""Scatter like that of the real mirrors beyond rounding."""


@cache
def imperfect_sweep(
    seed: int,
    *,
    mirrors: MirrorDisturbance = REAL_MIRRORS,
    turntable: TurntableErrors = REAL_TURNTABLE,
    volts_step_v: float = 1.0,
) -> SweepTable:
    """Return a serpentine sweep of 9 x 9 poses: volts and angles_deg of each eye, in the order of visit."""
    commanded_deg = serpentine_deg()
    true_rad = np.deg2rad(commanded_deg + _turntable_deg(turntable, np.random.default_rng([seed, 81])))
    angles_deg = np.round(commanded_deg, 2).tolist()
    pair = MirrorPair(mode=RIG120.mode, cutoff_hz=RIG120.low_pass_hz, t_ns=0, seed=seed)
    pair.disturb(mirrors)
    pair.set_rail(0, on=True)
    eyes = {role: FoldedEye(built_assembly(role, seed=seed)) for role in EYES}
    aimed_v = {role: aimed_volts(pair, eyes[role], role, true_rad) for role in EYES}
    found_v: dict[Role, list[NDArray[np.float64]]] = {role: [] for role in EYES}
    for index, target_rad in enumerate(true_rad):
        pair.set_codes(MOVE_NS * index, _codes([aimed_v[role][index] for role in EYES]))
        for role in EYES:
            tilt_rad = np.array([pair.tilt_rad(role, MOVE_NS * (index + 1) - 1)])
            miss_rad = _gazes_rad(eyes[role], tilt_rad)[0] - target_rad
            slope = _slopes(pair, eyes[role], role, aimed_v[role][index : index + 1])[0]
            found_v[role].append(aimed_v[role][index] - np.linalg.solve(slope, miss_rad))
    return {
        role.value: {
            "volts": (np.round(np.array(found_v[role]) / volts_step_v) * volts_step_v).tolist(),
            "angles_deg": angles_deg,
        }
        for role in EYES
    }


def write_sweep(sweep: SweepTable, folder: Path) -> Path:
    """Write a sweep to a file as `foveacam calibrate residuals` reads it."""
    path = folder / "sweep.json"
    path.write_text(json.dumps({"about": "simulated", **sweep}), encoding="utf-8")
    return path


def scan_of(sweep: SweepTable, role: Role, *, volts_step_v: float = 1.0) -> EyeScan:
    """Return one eye of a sweep in radians."""
    eye = sweep[role.value]
    return EyeScan(
        volts_v=np.array(eye["volts"]),
        angles_rad=np.deg2rad(np.array(eye["angles_deg"])),
        volts_step_v=volts_step_v,
        angles_step_rad=math.radians(0.01),
    )


def serpentine_deg() -> NDArray[np.float64]:
    """Return the commanded angles (81, 2), degrees: lines across, from right to left first, upwards."""
    across = np.linspace(HALF_WIDTH_DEG, -HALF_WIDTH_DEG, SIDE)
    down = np.linspace(HALF_HEIGHT_DEG, -HALF_HEIGHT_DEG, SIDE)
    lines = [np.column_stack([across[:: (-1) ** k], np.full(SIDE, y)]) for k, y in enumerate(down)]
    return np.vstack(lines)


def _turntable_deg(errors: TurntableErrors, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the errors of the target's direction (81, 2), degrees."""
    line, place = np.divmod(np.arange(SIDE**2), SIDE)
    backwards = line % 2 == 1
    last_pan = np.where(np.concatenate([backwards[:1], backwards[:-1]]), 1.0, -1.0)
    lag = last_pan[:, None] * np.array(errors.lag_deg)
    tilt = errors.line_rms_deg * rng.standard_normal(SIDE)[line]
    column = np.where(backwards, SIDE - 1 - place, place)
    pan = errors.position_rms_deg * rng.standard_normal(SIDE)[column]
    return np.asarray(lag + np.column_stack([pan, tilt]))


def aimed_volts(
    pair: MirrorPair, eye: FoldedEye, role: Role, targets_rad: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the volts (n, 2) with which an undisturbed mirror looks along (n, 2) angles, rad."""
    volts_v: NDArray[np.float64] = np.rad2deg(targets_rad) / np.array([0.06, 0.052])
    for _ in range(NEWTON_ROUNDS):
        miss_rad = _gazes_rad(eye, pair.laws[role].tilt_rad(volts_v)) - targets_rad
        volts_v -= np.linalg.solve(_slopes(pair, eye, role, volts_v), miss_rad[:, :, None])[:, :, 0]
    return volts_v


def _slopes(
    pair: MirrorPair, eye: FoldedEye, role: Role, volts_v: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the derivatives (n, 2, 2) of an undisturbed mirror's angles to volts (n, 2), rad per V."""
    middle, right, down = (
        _gazes_rad(eye, pair.laws[role].tilt_rad(volts_v + step)) for step in ((0, 0), (1, 0), (0, 1))
    )
    return np.stack([right - middle, down - middle], axis=2)


def _gazes_rad(eye: FoldedEye, tilts_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the axis-wise angles (n, 2), rad, along which the eye looks at tilts (n, 2)."""
    rays = np.array([gaze(eye.view(x_rad, y_rad)) for x_rad, y_rad in tilts_rad.tolist()])
    return np.asarray(np.arctan(rays[:, :2] / rays[:, 2:]))


def _codes(volts_v: list[NDArray[np.float64]]) -> tuple[int, ...]:
    """Return the DAC codes of both mirrors, their volts (2,) each."""
    sides = [NOMINAL_BIAS_V + side * v / 2 for each in volts_v for v in each.tolist() for side in (1.0, -1.0)]
    return tuple(round(side * FULL_SCALE_CODE / FULL_SCALE_V) for side in sides)
