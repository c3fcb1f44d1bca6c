"""Takes the drift of the mounts out of what the eyes measured: every row as it would be at the end."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.measured_rows import FitRow, volts_of
from foveacam_pipeline.calibrate.fit.mount_drift import MountDrift, turn_back
from foveacam_pipeline.calibrate.fit.mount_drift_fit import (
    DriftSamples,
    fit_mount_drift,
    has_enough_visits,
    turns_at,
)
from foveacam_pipeline.calibrate.fit.mount_knocks import split_at_knocks
from foveacam_pipeline.calibrate.fit.mount_moves import MOVE_ROUNDS, fit_moves


def remove_drift(
    rows: Mapping[Role, Sequence[FitRow]], group: Mapping[tuple[int, int], int], *, f_px: float
) -> tuple[dict[Role, list[FitRow]], dict[Role, MountDrift] | None]:
    """Return the rows of both eyes referred to the end of the last run, and the drift that was taken out.

    `group`: numbers of the nodes; sweeps share those at which they looked the same way. Where no nodes were
    visited again the rows come back as they were, but for far moves between runs, with None.
    """
    runs = sorted({run_key(row) for mine in rows.values() for row in mine})
    numbers = {run: number for number, run in enumerate(runs)}
    whole = {role: _samples(mine, numbers, group) for role, mine in rows.items()}
    samples = split_at_knocks(whole) if has_enough_visits(whole) else whole
    count = 1 + max(int(eye.run.max(initial=0)) for eye in samples.values())
    kept, far = {}, {}
    for role, mine in rows.items():
        moves = _remove_moves(list(mine), samples[role], runs=count, f_px=f_px)
        kept[role], samples[role], far[role] = moves
    found = fit_mount_drift(samples)
    if found is None:
        return kept, None
    for role, drift in found.items():
        turns = turns_at(drift, samples[role].t_s, samples[role].run)
        kept[role] = [_turned_back(row, turn, f_px=f_px) for row, turn in zip(kept[role], turns, strict=True)]
    ended = _runs_ended_by_knocks(whole, samples)
    return kept, {role: drift.moved_by(far[role]).knocked_after(ended) for role, drift in found.items()}


def _remove_moves(
    rows: list[FitRow], samples: DriftSamples, *, runs: int, f_px: float
) -> tuple[list[FitRow], DriftSamples, NDArray[np.float64]]:
    """Return all as if the mount had not been moved far between runs, and (runs, 3) how far it was.

    An eye that measured nothing in the last runs is referred to the end of its own last one.
    """
    moved = np.zeros((runs, 3))
    for _ in range(MOVE_ROUNDS if samples.run.any() else 0):
        found = fit_moves(samples.volts_v, samples.angles_rad, samples.depth_m, samples.run)
        if not moved.any() and not found.far:
            break
        turns = found.turn_rad[samples.run]
        rows = [_turned_back(row, turn, f_px=f_px) for row, turn in zip(rows, turns, strict=True)]
        samples = replace(samples, angles_rad=_angles(rows))
        moved[: len(found.turn_rad)] += found.turn_rad
    return rows, samples, moved


def _runs_ended_by_knocks(
    whole: Mapping[Role, DriftSamples], parted: Mapping[Role, DriftSamples]
) -> set[int]:
    """Return the numbers of those parted runs that the whole run outlasts."""
    origin = {
        part: run
        for role, samples in parted.items()
        for part, run in zip(samples.run.tolist(), whole[role].run.tolist(), strict=True)
    }
    return {part for part, run in origin.items() if origin.get(part + 1) == run}


def run_key(row: FitRow) -> tuple[str, int]:
    """Return in which run a row was measured; where nobody wrote it down, each sweep counts as one."""
    return (row.run, -1) if row.run else ("", row.node[0])


def _samples(
    rows: Sequence[FitRow], numbers: Mapping[tuple[str, int], int], group: Mapping[tuple[int, int], int]
) -> DriftSamples:
    return DriftSamples(
        volts_v=volts_of(rows),
        angles_rad=_angles(rows),
        depth_m=np.array([row.depth_m for row in rows], dtype=np.float64),
        t_s=1e-9 * np.array([row.t_ns for row in rows], dtype=np.float64),
        run=np.array([numbers[run_key(row)] for row in rows], dtype=np.int64),
        visit=np.array([row.visit for row in rows], dtype=np.bool_),
        group=np.array([group[row.node] for row in rows], dtype=np.int64),
    )


def _angles(rows: Sequence[FitRow]) -> NDArray[np.float64]:
    return np.array([row.angles_rad for row in rows], dtype=np.float64).reshape(-1, 2)


def _turned_back(row: FitRow, turn_rad: NDArray[np.float64], *, f_px: float) -> FitRow:
    gaze, corners = turn_back(row.angles_rad[None], row.plane_px[None], turn_rad[None], f_px=f_px)
    return replace(row, angles_rad=gaze[0], plane_px=corners[0])
