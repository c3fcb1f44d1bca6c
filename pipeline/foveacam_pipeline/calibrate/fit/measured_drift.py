"""Takes the drift of the mounts out of what the eyes measured: every row as it would be at the end."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.measured_rows import Row, volts_of
from foveacam_pipeline.calibrate.fit.mount_drift import MountDrift, referred
from foveacam_pipeline.calibrate.fit.mount_drift_fit import DriftSamples, fit_mount_drift, turns_of


def without_drift(
    rows: Mapping[Role, Sequence[Row]], group: Mapping[tuple[int, int], int], *, f_px: float
) -> tuple[dict[Role, list[Row]], dict[Role, MountDrift] | None]:
    """Return the rows of both eyes referred to the end of the last run, and the drift that was taken out.

    `group`: numbers of the nodes; sweeps share those at which they looked the same way. Where no nodes were
    visited again the rows come back as they were, with None.
    """
    kept = {role: list(mine) for role, mine in rows.items()}
    runs = sorted({run_of(row) for mine in kept.values() for row in mine})
    numbers = {run: number for number, run in enumerate(runs)}
    samples = {role: _samples(mine, numbers, group) for role, mine in kept.items()}
    found = fit_mount_drift(samples)
    if found is None:
        return kept, None
    for role, drift in found.items():
        turns = turns_of(drift, samples[role].t_s, samples[role].run)
        kept[role] = [_moved(row, turn, f_px=f_px) for row, turn in zip(kept[role], turns, strict=True)]
    return kept, found


def run_of(row: Row) -> tuple[str, int]:
    """Return in which run a row was measured; where nobody wrote it down, each sweep counts as one."""
    return (row.run, -1) if row.run else ("", row.node[0])


def _samples(
    rows: Sequence[Row], numbers: Mapping[tuple[str, int], int], group: Mapping[tuple[int, int], int]
) -> DriftSamples:
    return DriftSamples(
        volts_v=volts_of(rows),
        angles_rad=np.array([row.angles_rad for row in rows], dtype=np.float64).reshape(-1, 2),
        depth_m=np.array([row.depth_m for row in rows], dtype=np.float64),
        t_s=1e-9 * np.array([row.t_ns for row in rows], dtype=np.float64),
        run=np.array([numbers[run_of(row)] for row in rows], dtype=np.int64),
        visit=np.array([row.visit for row in rows], dtype=np.bool_),
        group=np.array([group[row.node] for row in rows], dtype=np.int64),
    )


def _moved(row: Row, turn_rad: NDArray[np.float64], *, f_px: float) -> Row:
    gaze, corners = referred(row.angles_rad[None], row.plane_px[None], turn_rad[None], f_px=f_px)
    return replace(row, angles_rad=gaze[0], plane_px=corners[0])
