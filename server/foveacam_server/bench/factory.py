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

from foveacam_hardware.contract import DeviceFault, MirrorVolts, Role
from foveacam_hardware.sim.optics import View
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.calibrate.fit import fit_calibration
from foveacam_pipeline.calibrate.samples import EyeSweep, RigSweep
from foveacam_pipeline.models import Calibration, Intrinsics, load_calibration, save_calibration
from foveacam_server.bench.certificate_check import assess

FOLDER = Path(__file__).resolve().parent.parent / "factory"
PRESETS = ("rig120", "paper")

WIDTH, HEIGHT = 1440, 1080  # of all three cameras (Sony IMX273)
MAX_V = 169.5  # just inside what the driver allows: the calibrated field is all that will be asked of it
GRID = 21
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

    def static_projection(self, role: Role, volts: MirrorVolts) -> View:
        """Return an eye's projection with its mirror at rest under `volts`."""
        ...

    def wide_pixels(self, points_rig_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the raw wide px (n, 2) of points (n, 3), m, rig frame."""
        ...


def certify(bench: Bench, *, rig_id: str, seed: int, created: datetime) -> Calibration:
    """Measure a rig on the bench and return its calibration."""
    rng = np.random.default_rng(seed)
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
        fovea_width=WIDTH,
        fovea_height=HEIGHT,
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
        view = bench.static_projection(role, MirrorVolts(x_v=float(pair[0]), y_v=float(pair[1])))
        ray = view.direction((WIDTH - 1) / 2, (HEIGHT - 1) / 2)
        seen = view.centre_m + (depth - view.centre_m[2]) / ray[2] * ray
        angles[k] = np.arctan((seen - reference)[:2] / depth)
        corners = seen + np.column_stack([board * depth / NOMINAL_FOCAL_PX, np.zeros(len(board))])
        raw[k] = view.pixels(corners)
    angles += np.deg2rad(ANGLE_NOISE_DEG) * rng.standard_normal(angles.shape)
    raw += CORNER_NOISE_PX * rng.standard_normal(raw.shape)
    raw[_outside(raw)] = np.nan
    return EyeSweep(
        volts_v=volts,
        angles_rad=angles,
        depth_m=depths,
        raw_px=raw,
        plane_px=np.broadcast_to(board, raw.shape).copy(),
    )


def measure_wide(bench: Bench, rng: np.random.Generator) -> Intrinsics:
    """Calibrate the wide camera on noisy corners of a chequerboard held at many attitudes."""
    columns, rows = np.meshgrid(np.arange(WIDE_COLUMNS), np.arange(WIDE_ROWS))
    board = np.column_stack([columns.ravel(), rows.ravel(), np.zeros(columns.size)]) * WIDE_PITCH_M
    board -= board.mean(axis=0)
    objects, images = [], []
    for _ in range(WIDE_VIEWS):
        turn = cv2.Rodrigues(rng.uniform([-0.6, -0.6, -0.3], [0.6, 0.6, 0.3]))[0]
        depth_m = rng.uniform(1.1, 2.2)
        place = np.array([*(rng.uniform([-0.14, -0.10], [0.14, 0.10]) * depth_m), depth_m])
        corners = bench.wide_pixels(board @ np.asarray(turn).T + place)
        corners += WIDE_NOISE_PX * rng.standard_normal(corners.shape)
        seen = ~_outside(corners)
        if int(seen.sum()) >= board.shape[0] // 3:
            objects.append(board[seen].astype(np.float32))
            images.append(corners[seen].astype(np.float32))
    guess = np.array([[3000.0, 0.0, (WIDTH - 1) / 2], [0.0, 3000.0, (HEIGHT - 1) / 2], [0.0, 0.0, 1.0]])
    flags = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3
    _, matrix, distortion, _, _ = cv2.calibrateCamera(
        objects, images, (WIDTH, HEIGHT), guess, np.zeros(5), flags=flags
    )
    return Intrinsics(
        width=WIDTH,
        height=HEIGHT,
        fx_px=float(matrix[0, 0]),
        fy_px=float(matrix[1, 1]),
        cx_px=float(matrix[0, 2]),
        cy_px=float(matrix[1, 2]),
        distortion=tuple(float(c) for c in np.ravel(distortion)[:5]),
    )


def _fovea_board_px() -> NDArray[np.float64]:
    """Return (20, 2) corners of the fovea's target on the virtual pinhole plane, px about its middle."""
    x = np.linspace(-0.5, 0.5, BOARD_COLUMNS) * BOARD_FILL * WIDTH
    y = np.linspace(-0.5, 0.5, BOARD_ROWS) * BOARD_FILL * HEIGHT
    return np.array([(u, v) for v in y for u in x])


def _outside(pixels: NDArray[np.float64]) -> NDArray[np.bool_]:
    limits = np.array([WIDTH - 0.5, HEIGHT - 0.5])
    return np.asarray(((pixels < -0.5) | (pixels > limits)).any(axis=-1))


def run(
    *, folder: Path = FOLDER, seed: int = 20_260, created: datetime | None = None, quick: bool = False
) -> dict[str, float]:
    """Write the certificates of both simulated rigs to `folder`; return the accuracy of the first.

    `quick` only judges the certificate that lies there, and writes nothing.
    """
    moment = created or datetime.now(tz=UTC)
    figures: dict[str, float] = {}
    for k, preset in enumerate(PRESETS[:1] if quick else PRESETS):
        with open_simulated(preset=preset, inline=True) as rig:
            if rig.truth is None:
                raise DeviceFault(f"rig {rig.rig_id} shows no truth; certify simulated rigs only")
            path = folder / f"{rig.rig_id}.json"
            if quick:
                return assess(load_calibration(path), rig.truth, seed=seed)
            calibration = certify(rig.truth, rig_id=rig.rig_id, seed=seed + k, created=moment)
            save_calibration(calibration, path)
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
