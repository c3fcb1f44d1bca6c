"""What is stated of a distance before any look: nothing, or with an error as large as it is stated."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, Role
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.render.projection import Projection
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.surroundings.known_depth import known_distance

WIDE = Intrinsics(width=1440, height=1080, fx_px=3158.0, fy_px=3158.0, cx_px=719.5, cy_px=539.5)
CELL_PX = 8
FOOTPRINT_PX = (85.0, 65.0)
"""Half sides of what a look measures about its target, wide px."""
FIELD_DEG = (8.0, 7.5)
SERIES, CLICKS = 30, 24
SIGMA_PER_M = 0.0007
TEXTURED_LEVELS = 2.0
FRONT = np.zeros(2)


class Known:
    """A context with the samples that a test gives it."""

    def __init__(self, samples: DepthSamples) -> None:
        self.samples = samples

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        return self.samples.near(target, reach_tan=reach_tan)


def frame(image: NDArray[np.uint8]) -> Frame:
    return Frame(image=image, role=Role.WIDE, seq=1, t_ns=0, exposure_ns=1_000_000)


def noise(levels: float) -> Frame:
    rough = np.random.default_rng(1).normal(120.0, levels, (WIDE.height, WIDE.width))
    return frame(np.clip(rough, 0, 255).astype(np.uint8))


def wall(offsets_px: NDArray[np.float64], z_m: float) -> Known:
    count = len(offsets_px)
    return Known(
        DepthSamples(
            tangents=offsets_px / WIDE.fx_px,
            inverse_z_per_m=np.full(count, 1.0 / z_m),
            sigma_per_m=np.full(count, SIGMA_PER_M),
        )
    )


RING_PX: NDArray[np.float64] = 40.0 * np.array(
    [[math.cos(a), math.sin(a)] for a in np.linspace(0.0, 6.0, 12)]
)


@dataclass
class SeenScene:
    """The depth of a scene's wide view, by the renderer, and the cells of it that can be measured."""

    name: str

    @cached_property
    def drawn(self) -> tuple[NDArray[np.float64], Frame]:
        k = np.array([[WIDE.fx_px, 0.0, WIDE.cx_px], [0.0, WIDE.fy_px, WIDE.cy_px], [0.0, 0.0, 1.0]])
        view = Projection(
            M=k, C=np.zeros(3), width=WIDE.width, height=WIDE.height, axis=np.array([0.0, 0.0, 1.0])
        )
        stage = AnimatedScene(self.name)
        try:
            found = stage.probe(view, 0.0)
        finally:
            stage.close()
        q = np.where(found.ids < 0, 0.0, 1.0 / np.maximum(found.depth_m, 1e-6))
        return q, frame(np.clip(255.0 * found.radiance, 0, 255).astype(np.uint8))

    def cells(self, rng: np.random.Generator) -> tuple[DepthSamples, NDArray[np.float64]]:
        """Return nearest and farthest surface of each textured cell, and where it is, (n, 2) wide px."""
        q, shown = self.drawn
        rows, columns = WIDE.height // CELL_PX, WIDE.width // CELL_PX
        shape = (rows, CELL_PX, columns, CELL_PX)
        levels = shown.image.astype(np.float64).reshape(shape).std(axis=(1, 3))
        by_cell = q.reshape(shape).transpose(0, 2, 1, 3).reshape(rows, columns, -1)
        ends = np.quantile(by_cell, (0.1, 0.9), axis=2, method="nearest")
        known = (levels > TEXTURED_LEVELS) & (ends > 0.0)
        _, row, column = np.nonzero(known)
        at_px = np.array([column, row], dtype=np.float64).T * CELL_PX + (CELL_PX - 1) / 2
        measured = ends[known] + SIGMA_PER_M * rng.standard_normal(len(row))
        sigma = np.full(len(row), SIGMA_PER_M)
        tangents = (at_px - np.array([WIDE.cx_px, WIDE.cy_px])) / WIDE.fx_px
        return DepthSamples(tangents=tangents, inverse_z_per_m=measured, sigma_per_m=sigma), at_px


@dataclass(frozen=True)
class Stated:
    """What was stated of many clicks: errors over stated errors; how often of all, and of the sky."""

    sigmas: NDArray[np.float64]
    share: float
    sky_share: float


def stated(scene: SeenScene) -> Stated:
    """Click about, each look measuring what is about its target; compare what is stated with the truth."""
    rng = np.random.default_rng(7)
    q, shown = scene.drawn
    samples, at_px = scene.cells(rng)
    sigmas, sky = [], []
    for _ in range(SERIES):
        seen = np.zeros(len(samples), dtype=np.bool_)
        for _ in range(CLICKS):
            target = np.tan(np.radians(rng.uniform(-np.array(FIELD_DEG), FIELD_DEG)))
            x_px, y_px = (target * WIDE.fx_px + [WIDE.cx_px, WIDE.cy_px]).tolist()
            true_q = float(q[round(y_px), round(x_px)])
            point = known_distance(Known(samples.only(seen)), target, WIDE, frame=shown)
            if true_q == 0.0:
                sky.append(point is not None)
            elif point is not None:
                truth_m = math.hypot(*target.tolist(), 1.0) / true_q
                sigmas.append((point.distance_m - truth_m) / point.distance_sigma_m)
            seen |= (np.abs(at_px - [x_px, y_px]) < FOOTPRINT_PX).all(axis=1)
    share = len(sigmas) / (SERIES * CLICKS - len(sky))
    return Stated(np.array(sigmas, dtype=np.float64), share, float(np.mean(sky)) if sky else 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bench", "street"])
def test_first_estimates_err_as_much_as_they_state(name: str) -> None:
    found = stated(SeenScene(name))
    assert 0.7 <= float(np.sqrt(np.mean(found.sigmas**2))) <= 1.3
    assert found.share >= 0.5
    assert found.sky_share <= 0.25


def test_nothing_is_stated_where_nothing_was_measured() -> None:
    nothing = Known(DepthSamples.none())
    assert known_distance(nothing, FRONT, WIDE, frame=noise(20.0)) is None
    far_off = wall(np.array([[400.0, 0.0], [0.0, 400.0]]), 8.0)
    assert known_distance(far_off, FRONT, WIDE, frame=noise(20.0)) is None


def test_measured_place_is_stated_with_its_depth_and_less_error_than_one_beside_it() -> None:
    here = known_distance(wall(RING_PX / 20.0, 8.0), FRONT, WIDE, frame=noise(20.0))
    beside = known_distance(wall(RING_PX, 8.0), FRONT, WIDE, frame=noise(20.0))
    assert here is not None and beside is not None
    assert here.distance_m == pytest.approx(8.0) == beside.distance_m
    assert 0.04 <= here.distance_sigma_m < beside.distance_sigma_m


def test_blank_place_is_stated_only_where_what_was_measured_surrounds_it() -> None:
    one_side = RING_PX[RING_PX[:, 1] > 0.0]
    assert known_distance(wall(one_side, 8.0), FRONT, WIDE, frame=noise(0.5)) is None
    assert known_distance(wall(one_side, 8.0), FRONT, WIDE, frame=None) is None
    assert known_distance(wall(one_side, 8.0), FRONT, WIDE, frame=noise(20.0)) is not None
    assert known_distance(wall(RING_PX, 8.0), FRONT, WIDE, frame=noise(0.5)) is not None


def test_edge_between_near_and_far_is_too_vague_to_be_stated() -> None:
    near, far = wall(RING_PX[::2], 2.0).samples, wall(RING_PX[1::3], 30.0).samples
    assert known_distance(Known(near.joined(far)), FRONT, WIDE, frame=noise(20.0)) is None
