"""Measure lengths and planes in looks at the bench scene, and judge them by the simulation's truth.

Each look is a fixation on the simulated rig with the calibration that ships, at a seeded random wide pixel.
The truth of a pixel of a look is where the ray of its raw left pixel, by the true optics, meets the scene.
Lengths are measured between random known pixels of one object in one look, planes over truly flat squares.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.figures import Figures
from foveacam_hardware.contract import InvalidInput, Role, Sighting
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.truth import Truth
from foveacam_pipeline.measure.length import length_between
from foveacam_pipeline.measure.look import LookDepth, look_depth
from foveacam_pipeline.measure.plane import fit_plane
from foveacam_pipeline.measure.point import beside_edge, point_at
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.stereo.depth import depth_map
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import PixelTarget
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.click_truth import truth_of

CERTIFICATE = SHIPPED / "sim-rig120.json"
SCENE = "bench"
SEED = 20_27
LOOKS, QUICK_LOOKS = 24, 4
FIELD_PX = ((290.0, 1150.0), (130.0, 950.0))
"""Region within reach of both eyes of the shipped calibration, wide px: x and y, from and to."""
PAIRS = 40
"""Pairs of pixels in each look."""
SQUARES = 12
"""Candidate squares for planes in each look."""
SQUARE_PX = 90
LEAST_LENGTH_PX = 20.0
FLAT_SHARE = 1e-4
"""A square is flat when its true points deviate from a plane by less than this share of the distance, rms."""
SCALE = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrueLook:
    """A look, and the truth of its window: (h, w, 3) m, rig frame, and (h, w) object numbers, -1 for none."""

    look: LookDepth
    points_m: NDArray[np.float64]
    ids: NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedLength:
    """One measured length against the truth, m."""

    true_m: float
    error_m: float
    sigma_m: float
    at_edge: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedPlane:
    """The angle between a measured and the true normal, and the stated rms of it, rad."""

    angle_rad: float
    sigma_rad: float


def run(*, quick: bool = False) -> Figures:
    """Look, measure, judge, and return the figures."""
    lengths: list[JudgedLength] = []
    planes: list[JudgedPlane] = []
    looks = 0
    for number, seen in enumerate(true_looks(QUICK_LOOKS if quick else LOOKS)):
        rng = np.random.default_rng([SEED, number])
        lengths.extend(judge_lengths(seen, rng))
        planes.extend(judge_planes(seen, rng))
        looks += 1
    return {"measure_looks": looks, **length_figures(lengths), **plane_figures(planes)}


def true_looks(count: int) -> Iterator[TrueLook]:
    """Yield `count` verged looks at seeded random pixels of the scene, with their truth."""
    calibration = load_calibration(CERTIFICATE)
    rng = np.random.default_rng(SEED)
    with open_simulated(scene=SCENE, inline=True) as rig:
        found = 0
        while found < count:
            (x0, x1), (y0, y1) = FIELD_PX
            seen = _look(rig, calibration, (float(rng.uniform(x0, x1)), float(rng.uniform(y0, y1))))
            if seen is not None:
                found += 1
                yield seen


def _look(rig: Rig, calibration: Calibration, pixel: tuple[float, float]) -> TrueLook | None:
    """Return a look at a wide pixel with its truth; None when the eyes do not verge there."""
    target = PixelTarget(x_px=pixel[0], y_px=pixel[1])
    fixation = fixate(rig.head, calibration, target, clock=rig.clock)
    sighting = fixation.sighting
    if fixation.distance_m is None or sighting is None:
        return None
    pair = rectify(sighting, calibration, scale=SCALE)
    depth = depth_map(pair, match(pair))
    look = look_depth(pair, depth, calibration=calibration, volts=sighting.volts, scale=SCALE)
    if not np.isfinite(look.z_m).any():
        return None
    return true_look(truth_of(rig), look, sighting)


def true_look(truth: Truth, look: LookDepth, sighting: Sighting) -> TrueLook:
    """Return the true points and objects that the pixels of a look's left window show."""
    t_ns = sighting.left.t_ns
    view = truth.projection(Role.LEFT, t_ns)
    drawn = truth.world.animated_scene.probe(view, truth.world.scene_s(t_ns))
    width, height = look.size_px
    ys, xs = np.indices((height, width))
    window = np.column_stack([xs.ravel(), ys.ravel(), np.ones(xs.size)])
    mapped = np.linalg.solve(look.window_from_left, window.T)
    raw = (mapped[:2] / mapped[2]).T
    nearest = np.rint(raw).astype(np.int64)
    inside = (nearest >= 0).all(axis=1) & (nearest[:, 0] < view.width) & (nearest[:, 1] < view.height)
    held = np.clip(nearest, 0, (view.width - 1, view.height - 1))
    depth_m = drawn.depth_m[held[:, 1], held[:, 0]].astype(np.float64)
    ids = np.where(inside, drawn.ids[held[:, 1], held[:, 0]].astype(np.int64), -1)
    points_m = view.points(raw, np.where(ids >= 0, depth_m, np.nan))
    return TrueLook(look=look, points_m=points_m.reshape(height, width, 3), ids=ids.reshape(height, width))


def judge_lengths(seen: TrueLook, rng: np.random.Generator) -> Iterator[JudgedLength]:
    """Yield lengths between random known pixels of one object."""
    look = seen.look
    rows, columns = np.nonzero(np.isfinite(look.z_m) & (seen.ids >= 0))
    for first, second in rng.integers(0, len(rows), (PAIRS, 2)):
        a, b = ((int(columns[k]), int(rows[k])) for k in (first, second))
        if seen.ids[a[1], a[0]] != seen.ids[b[1], b[0]] or math.dist(a, b) < LEAST_LENGTH_PX:
            continue
        found = length_between(point_at(look, *a, look_id="look"), point_at(look, *b, look_id="look"))
        true_m = float(np.linalg.norm(seen.points_m[a[1], a[0]] - seen.points_m[b[1], b[0]]))
        yield JudgedLength(
            true_m=true_m,
            error_m=found.length_m - true_m,
            sigma_m=found.length_sigma_m,
            at_edge=beside_edge(look, *a) or beside_edge(look, *b),
        )


def judge_planes(seen: TrueLook, rng: np.random.Generator) -> Iterator[JudgedPlane]:
    """Yield planes through random squares that lie on one object and are flat in truth."""
    width, height = seen.look.size_px
    for _ in range(SQUARES):
        x, y = int(rng.integers(0, width - SQUARE_PX)), int(rng.integers(0, height - SQUARE_PX))
        square = (slice(y, y + SQUARE_PX), slice(x, x + SQUARE_PX))
        normal = _true_normal(seen.points_m[square], seen.ids[square])
        if normal is None:
            continue
        region = np.zeros((height, width), dtype=np.bool_)
        region[square] = True
        outline = np.array([(x, y), (x + SQUARE_PX, y), (x + SQUARE_PX, y + SQUARE_PX)], dtype=np.float64)
        try:
            plane = fit_plane(seen.look, region, outline_px=outline)
        except InvalidInput:
            continue  # no texture: the tool refuses, too
        angle_rad = math.acos(min(1.0, abs(float(normal @ np.array(plane.normal)))))
        yield JudgedPlane(angle_rad=angle_rad, sigma_rad=plane.normal_sigma_rad)


def _true_normal(points_m: NDArray[np.float64], ids: NDArray[np.int64]) -> NDArray[np.float64] | None:
    """Return the (3,) normal of a square's true points; None unless they are a plane of one object."""
    if ids.min() < 0 or ids.min() != ids.max():
        return None
    rows = points_m.reshape(-1, 3)
    centred = rows - rows.mean(axis=0)
    _, sizes, axes = np.linalg.svd(centred, full_matrices=False)
    rms_m = float(sizes[2]) / math.sqrt(len(rows))
    flat = rms_m < FLAT_SHARE * float(np.linalg.norm(rows.mean(axis=0)))
    return np.asarray(axes[2], dtype=np.float64) if flat else None


def length_figures(lengths: list[JudgedLength]) -> Figures:
    """Return the figures of lengths without those with an end beside an edge, of which the tool warns."""
    clear = [length for length in lengths if not length.at_edge]
    relative = np.array([abs(length.error_m) / length.true_m for length in clear])
    sigmas = np.array([abs(length.error_m) / length.sigma_m for length in clear])
    return {
        "lengths": len(clear),
        "length_rel_error_median": _quantile(relative, 0.5),
        "length_rel_error_p95": _quantile(relative, 0.95),
        "length_within_1_sigma": _share(sigmas, 1.0),
        "length_within_3_sigma": _share(sigmas, 3.0),
        "length_edge_fraction": (len(lengths) - len(clear)) / max(1, len(lengths)),
    }


def plane_figures(planes: list[JudgedPlane]) -> Figures:
    """Return the figures of planes; 63 % of two-dimensional normal errors are within their rms."""
    angles = np.degrees([plane.angle_rad for plane in planes])
    sigmas = np.array([plane.angle_rad / plane.sigma_rad for plane in planes])
    return {
        "planes": len(planes),
        "plane_angle_error_median_deg": _quantile(angles, 0.5),
        "plane_angle_error_p95_deg": _quantile(angles, 0.95),
        "plane_within_1_sigma": _share(sigmas, 1.0),
        "plane_within_3_sigma": _share(sigmas, 3.0),
    }


def _quantile(values: NDArray[np.float64], part: float) -> float | None:
    return float(np.quantile(values, part)) if len(values) else None


def _share(values: NDArray[np.float64], limit: float) -> float | None:
    return float(np.mean(values <= limit)) if len(values) else None
