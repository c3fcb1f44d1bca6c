"""The factory certificate of the simulated rigs, and how good it is.

A bench in the factory sweeps both mirrors over their reach, looks at flat targets at two depths and at a
chequerboard with the wide camera, measures with realistic noise, and fits the pipeline's own models. The
simulation's truth stands in for the surveyed bench; the fit sees measurements only. `foveacam bench factory`.
"""

import argparse
import json
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, Role
from foveacam_hardware.sim.render.projection import Projection
from foveacam_pipeline.calibrate import EyeSweep, RigSweep, fit_calibration
from foveacam_pipeline.models import Calibration, Intrinsics, save_calibration
from foveacam_server.bench.certificate_check import assess

FOLDER = Path(__file__).resolve().parent.parent / "factory"
PRESETS = ("rig120", "paper")

MAX_V = 169.5  # just inside what the driver allows: the calibrated field is all that will be asked of it
GRID = 17
DEPTHS_M = (2.5, 10.0)  # two, so that the sweep also shows where each gaze leaves and where the pupil stands
ANGLE_NOISE_DEG = 0.005
CORNER_NOISE_PX = 0.3
BOARD_COLUMNS, BOARD_ROWS = 5, 4
BOARD_FILL = 0.85  # of the fovea's field
NOMINAL_BASELINE_M = 0.2  # Table 2
NOMINAL_FOCAL_PX = 28_760.0  # Table 2: 100 mm on 3.45 um
NOMINAL_PUPIL_M = 0.04  # drawing of the fold

WIDE_VIEWS = 40
WIDE_COLUMNS, WIDE_ROWS, WIDE_PITCH_M = 12, 9, 0.05
WIDE_NOISE_PX = 0.05


class Bench(Protocol):
    """The surveyed bench: where each camera really sees, mirrors at rest."""

    def static_projection(self, role: Role, volts: MirrorVolts) -> Projection:
        """Return the projection of a camera; `volts` moves the mirror of an eye."""
        ...


def certify(bench: Bench, *, rig_id: str, seed: int, created: datetime) -> Calibration:
    """Measure a rig on the bench and return its calibration."""
    rng = np.random.default_rng(seed)
    fovea = bench.static_projection(Role.LEFT, MirrorVolts(x_v=0.0, y_v=0.0))
    sweep = RigSweep(
        rig_id=rig_id,
        created_utc=created.isoformat(timespec="seconds"),
        origin="factory",
        label=f"factory certificate of {rig_id}",
        wide=measure_wide(bench, rng),
        left=measure_eye(bench, Role.LEFT, rng),
        right=measure_eye(bench, Role.RIGHT, rng),
        baseline_m=NOMINAL_BASELINE_M,
        fovea_f_px=NOMINAL_FOCAL_PX,
        fovea_width=fovea.width,
        fovea_height=fovea.height,
        pupil_m=NOMINAL_PUPIL_M,
    )
    return fit_calibration(sweep)


def measure_eye(bench: Bench, role: Role, rng: np.random.Generator) -> EyeSweep:
    """Return the sweep of one eye: a grid of volts, at each depth, with noise on angles and corners."""
    line_v = np.linspace(-MAX_V, MAX_V, GRID)
    volts = np.array([(x_v, y_v) for _ in DEPTHS_M for y_v in line_v for x_v in line_v])
    depths = np.repeat(DEPTHS_M, GRID * GRID)
    angles = np.empty_like(volts)
    board = _fovea_board_px()
    raw = np.empty((len(volts), len(board), 2))
    reference = np.array([(-0.5 if role is Role.LEFT else 0.5) * NOMINAL_BASELINE_M, 0.0, 0.0])
    for k, (pair, depth) in enumerate(zip(volts, depths, strict=True)):
        projection = bench.static_projection(role, MirrorVolts(x_v=float(pair[0]), y_v=float(pair[1])))
        seen = centre_point(projection, depth_m=float(depth))
        angles[k] = np.arctan((seen - reference)[:2] / depth)
        corners = seen + np.column_stack([board * depth / NOMINAL_FOCAL_PX, np.zeros(len(board))])
        raw[k] = projection.project(corners)
    angles += np.deg2rad(ANGLE_NOISE_DEG) * rng.standard_normal(angles.shape)
    raw += CORNER_NOISE_PX * rng.standard_normal(raw.shape)
    raw[_outside(raw, projection)] = np.nan
    return EyeSweep(
        volts_v=volts,
        angles_rad=angles,
        depth_m=depths,
        raw_px=raw,
        plane_px=np.broadcast_to(board, raw.shape).copy(),
    )


def centre_point(projection: Projection, *, depth_m: float) -> NDArray[np.float64]:
    """Return the (3,) point, m, rig frame, at Z = `depth_m` that the image centre sees."""
    middle = [[(projection.width - 1) / 2.0, (projection.height - 1) / 2.0]]
    ray = projection.rays_at(middle)[0]
    point: NDArray[np.float64] = projection.C + (depth_m - projection.C[2]) / ray[2] * ray
    return point


def measure_wide(bench: Bench, rng: np.random.Generator) -> Intrinsics:
    """Calibrate the wide camera on noisy corners of a chequerboard held at many attitudes."""
    projection = bench.static_projection(Role.WIDE, MirrorVolts(x_v=0.0, y_v=0.0))
    columns, rows = np.meshgrid(np.arange(WIDE_COLUMNS), np.arange(WIDE_ROWS))
    board = np.column_stack([columns.ravel(), rows.ravel(), np.zeros(columns.size)]) * WIDE_PITCH_M
    board -= board.mean(axis=0)
    objects, images = [], []
    for _ in range(WIDE_VIEWS):
        turn = cv2.Rodrigues(rng.uniform([-0.6, -0.6, -0.3], [0.6, 0.6, 0.3]))[0]
        depth_m = rng.uniform(1.1, 2.2)
        place = np.array([*(rng.uniform([-0.14, -0.10], [0.14, 0.10]) * depth_m), depth_m])
        corners = distorted_px(projection, board @ np.asarray(turn).T + place)
        corners += WIDE_NOISE_PX * rng.standard_normal(corners.shape)
        seen = ~_outside(corners, projection)
        if int(seen.sum()) >= board.shape[0] // 3:
            objects.append(board[seen].astype(np.float32))
            images.append(corners[seen].astype(np.float32))
    size = (projection.width, projection.height)
    guess = np.array([[3000.0, 0.0, (size[0] - 1) / 2], [0.0, 3000.0, (size[1] - 1) / 2], [0.0, 0.0, 1.0]])
    flags = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3
    _, matrix, distortion, _, _ = cv2.calibrateCamera(objects, images, size, guess, np.zeros(5), flags=flags)
    return Intrinsics(
        width=size[0],
        height=size[1],
        fx_px=float(matrix[0, 0]),
        fy_px=float(matrix[1, 1]),
        cx_px=float(matrix[0, 2]),
        cy_px=float(matrix[1, 2]),
        distortion=tuple(float(c) for c in np.ravel(distortion)[:5]),
    )


def distorted_px(projection: Projection, points_rig_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (n, 2) raw px at which a camera with a lens sees points (n, 3), rig frame."""
    ideal = projection.project(points_rig_m)
    raw = ideal.copy()
    for _ in range(
        20
    ):  # the lens moves a pixel by a few per cent less than its neighbour: this contracts fast
        raw = raw + ideal - projection.undistort(raw)
    return raw


def _fovea_board_px() -> NDArray[np.float64]:
    """Return (20, 2) corners of the fovea's target on the virtual pinhole plane, px about its middle."""
    x = np.linspace(-0.5, 0.5, BOARD_COLUMNS) * BOARD_FILL * 1440
    y = np.linspace(-0.5, 0.5, BOARD_ROWS) * BOARD_FILL * 1080
    return np.array([(u, v) for v in y for u in x])


def _outside(pixels: NDArray[np.float64], projection: Projection) -> NDArray[np.bool_]:
    limits = np.array([projection.width - 0.5, projection.height - 0.5])
    return np.asarray(((pixels < -0.5) | (pixels > limits)).any(axis=-1))


def run(*, folder: Path = FOLDER, seed: int = 20_260, created: datetime | None = None) -> dict[str, float]:
    """Write the certificates of both simulated rigs to `folder`; return the accuracy of the first."""
    from foveacam_hardware.sim.rig import open_simulated

    moment = created or datetime.now(tz=UTC)
    figures: dict[str, float] = {}
    for k, preset in enumerate(PRESETS):
        with open_simulated(preset=preset, inline=True) as rig:
            calibration = certify(rig.truth, rig_id=f"sim-{preset}", seed=seed + k, created=moment)
            save_calibration(calibration, folder / f"sim-{preset}.json")
            figures = figures or assess(calibration, rig.truth, seed=seed)
    return figures


def main() -> None:
    """Write the certificates and print the figures as one JSON object."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--folder", type=Path, default=FOLDER)
    arguments = parser.parse_args()
    sys.stdout.write(json.dumps(run(folder=arguments.folder)) + "\n")


if __name__ == "__main__":
    main()
