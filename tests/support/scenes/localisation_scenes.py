"""Synthetic pairs of a textured target at a known point, and experiments whose errors are known."""

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.study.localisation.estimator import LocalisedTarget, PairView, PixelPlane
from foveacam_pipeline.study.localisation.experiment import (
    ExperimentPlan,
    ExperimentRecord,
    Pair,
    TargetEstimate,
)
from foveacam_pipeline.study.localisation.rail import targets_m

Floats = NDArray[np.float64]
BASELINE_M = 0.2
SHORTEST_PX, LONGEST_PX = 6.0, 24.0
"""Wavelengths of the texture: as fine as the optics of both cameras pass."""
WAVES = 24
CONTRAST = 12.0


def texture(x_px: Floats, y_px: Floats, *, seed: int = 3) -> Floats:
    """Return the brightness of a random texture at any places: a sum of plane waves, known exactly."""
    rng = np.random.default_rng(seed)
    turn_rad, phase_rad = rng.uniform(0.0, 2.0 * np.pi, (2, WAVES))
    frequency = 2.0 * np.pi / rng.uniform(SHORTEST_PX, LONGEST_PX, WAVES)
    total = np.full(np.broadcast(x_px, y_px).shape, 120.0)
    for turn, phase, wave in zip(turn_rad, phase_rad, frequency, strict=True):
        along = np.cos(turn) * x_px + np.sin(turn) * y_px
        total += CONTRAST * np.sqrt(2.0 / WAVES) * np.cos(wave * along + phase)
    return total


def view_of(
    point_m: tuple[float, float, float],
    *,
    planes: tuple[PixelPlane, PixelPlane],
    f_px: float,
    size: tuple[int, int] = (320, 120),
    noise: float = 0.0,
    seed: int = 0,
) -> PairView:
    """Return two pictures (width, height) in which the texture's origin is at the images of a point."""
    rng = np.random.default_rng(seed)
    y_px, x_px = np.mgrid[: size[1], : size[0]].astype(np.float64)
    pictures = []
    for plane, eye_m in zip(planes, (-BASELINE_M / 2.0, BASELINE_M / 2.0), strict=True):
        x_m, y_m, z_m = point_m
        at_x, at_y = plane.pixels_from_plane(f_px * np.array([[(x_m - eye_m) / z_m, y_m / z_m]]))[0]
        picture = texture(x_px - at_x, y_px - at_y) + noise * rng.standard_normal(x_px.shape)
        pictures.append(picture.astype(np.float32))
    return PairView(
        left=pictures[0],
        right=pictures[1],
        left_plane=planes[0],
        right_plane=planes[1],
        f_px=f_px,
        baseline_m=BASELINE_M,
    )


def record_of(
    plan: ExperimentPlan,
    depth_errors_m: dict[Pair, float],
    *,
    missed: tuple[int, ...] = (),
    drift_m: float = 0.0,
) -> ExperimentRecord:
    """Return an experiment in which both pairs err along depth by plus and minus so much, slot by slot.

    `missed`: slots in which no target is found. `drift_m`: common to all positions, along depth.
    """
    record = ExperimentRecord(plan=plan)
    for standoff_m in plan.standoffs_m:
        truth_m = targets_m(plan.positions, standoff_m)
        for pair, error_m in depth_errors_m.items():
            record.bounds_px[pair, standoff_m] = 0.01
            for trial in range(plan.trials):
                for slot, (x_m, y_m, z_m) in enumerate(truth_m.tolist()):
                    at_m = (x_m, y_m, z_m + drift_m + error_m * (-1.0) ** slot)
                    found = LocalisedTarget(point_rig_m=at_m, disparity_px=50.0, score=0.9)
                    record.estimates.append(
                        TargetEstimate(
                            pair=pair,
                            standoff_m=standoff_m,
                            trial=trial,
                            slot=slot,
                            found=None if slot in missed else found,
                        )
                    )
    return record
