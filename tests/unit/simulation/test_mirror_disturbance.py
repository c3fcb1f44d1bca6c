"""Disturbed mirrors of the simulated rig: scatter from move to move and hysteresis, none by default."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError
from tests.support.scenes.simulated_gaze import gaze

from foveacam_hardware.contract import MirrorVolts, Role, StereoVolts
from foveacam_hardware.sim.mirror import FULL_SCALE_CODE, FULL_SCALE_V, NOMINAL_BIAS_V, MirrorPair
from foveacam_hardware.sim.optics import FoldedEye, built_assembly
from foveacam_hardware.sim.presets import RIG120
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.simulated_faults import MIRROR_AXES, MirrorDisturbance

SCATTER = MirrorDisturbance(scatter_rms_deg=0.01)
LAG = MirrorDisturbance(hysteresis_deg=0.02)
MOVE_NS = 250_000_000
EYES = (Role.LEFT, Role.RIGHT)
MOVES = 400
Pair = tuple[float, float]


def disturbed_pair(disturbance: MirrorDisturbance | None = None, *, seed: int = 0) -> MirrorPair:
    pair = MirrorPair(mode=RIG120.mode, cutoff_hz=120, t_ns=0, seed=seed)
    if disturbance is not None:
        pair.disturb(disturbance)
    pair.set_rail(0, on=True)
    return pair


def codes(left: Pair, right: Pair) -> tuple[int, ...]:
    """Return the DAC codes of both mirrors at volts (x, y)."""
    sides = [NOMINAL_BIAS_V + side * v / 2 for v in (*left, *right) for side in (1.0, -1.0)]
    return tuple(round(side * FULL_SCALE_CODE / FULL_SCALE_V) for side in sides)


def tilts_after_moves(pair: MirrorPair, volts: Sequence[Pair]) -> NDArray[np.float64]:
    """Return the tilts (moves, eyes, 2) of both mirrors at rest after each move to the same volts."""
    found = []
    for move, each in enumerate(volts):
        pair.set_codes(MOVE_NS * move, codes(each, each))
        found.append([pair.tilt_rad(role, MOVE_NS * (move + 1) - 1) for role in EYES])
    return np.array(found)


def there_and_back(count: int) -> list[Pair]:
    """Return moves that end at the same place, from alternating places."""
    return [(0.0, 0.0) if move % 2 else (40.0, -30.0) for move in range(2 * count)]


def gazes_deg(tilts_rad: NDArray[np.float64], role: Role) -> NDArray[np.float64]:
    """Return the axis-wise angles (n, 2), degrees, along which an eye looks at tilts (n, 2)."""
    eye = FoldedEye(built_assembly(role, seed=0))
    rays = np.array([gaze(eye.view(x_rad, y_rad)) for x_rad, y_rad in tilts_rad.tolist()])
    return np.asarray(np.rad2deg(np.arctan(rays[:, :2] / rays[:, 2:])))


def test_without_a_disturbance_every_tilt_is_bit_equal() -> None:
    rng = np.random.default_rng(3)
    volts = [(x, y) for x, y in rng.uniform(-150.0, 150.0, (20, 2)).tolist()]
    plain = tilts_after_moves(disturbed_pair(), volts)
    np.testing.assert_array_equal(tilts_after_moves(disturbed_pair(MirrorDisturbance()), volts), plain)
    assert np.abs(tilts_after_moves(disturbed_pair(SCATTER), volts) - plain).max() > 1e-5


def test_repeated_moves_scatter_by_the_stated_angle() -> None:
    tilts = tilts_after_moves(disturbed_pair(SCATTER), there_and_back(MOVES))[1::2]
    # The standard error of a deviation of n draws is 1 / sqrt(2 n) of it: 3.5 %; three of them
    for number, role in enumerate(EYES):
        spread_deg = gazes_deg(tilts[:, number], role).std(axis=0)
        np.testing.assert_allclose(spread_deg, SCATTER.scatter_rms_deg, rtol=3.0 / math.sqrt(2.0 * MOVES))


def test_axes_and_mirrors_scatter_independently() -> None:
    tilts = tilts_after_moves(disturbed_pair(SCATTER), there_and_back(MOVES))[1::2].reshape(-1, 4)
    moves = np.corrcoef(tilts.T) - np.eye(4)
    assert np.abs(moves).max() < 4.0 / math.sqrt(MOVES)
    assert abs(np.corrcoef(tilts[:-1, 0], tilts[1:, 0])[0, 1]) < 4.0 / math.sqrt(MOVES)


def test_a_mirror_at_rest_keeps_its_deviation_and_one_that_moves_draws_anew() -> None:
    pair = disturbed_pair(SCATTER)
    pair.set_codes(0, codes((10.0, 0.0), (10.0, 0.0)))
    settled = {role: pair.tilt_rad(role, MOVE_NS) for role in EYES}
    pair.set_codes(MOVE_NS, codes((10.0, 0.0), (20.0, 0.0)))
    pair.set_codes(2 * MOVE_NS, codes((10.0, 0.0), (10.0, 0.0)))
    assert pair.tilt_rad(Role.LEFT, 3 * MOVE_NS) == pytest.approx(settled[Role.LEFT], abs=1e-12)
    assert pair.tilt_rad(Role.RIGHT, 3 * MOVE_NS) != pytest.approx(settled[Role.RIGHT], abs=1e-7)


def test_a_deviation_is_filtered_like_the_drive() -> None:
    pair = disturbed_pair(MirrorDisturbance(scatter_rms_deg=0.5))
    pair.set_codes(0, codes((0.0, 0.0), (0.0, 0.0)))
    before = pair.tilt_rad(Role.LEFT, MOVE_NS)
    pair.set_codes(MOVE_NS, codes((0.01, 0.0), (0.01, 0.0)))  # a small move with a whole deviation
    at_once = pair.tilt_rad(Role.LEFT, MOVE_NS + 100_000)
    settled = pair.tilt_rad(Role.LEFT, 2 * MOVE_NS)
    assert math.dist(at_once, before) < 0.01 * math.dist(settled, before)


def test_a_seed_makes_the_same_deviations_and_another_seed_others() -> None:
    volts = there_and_back(3)
    first, again, other = (tilts_after_moves(disturbed_pair(SCATTER, seed=seed), volts) for seed in (4, 4, 5))
    plain = {seed: tilts_after_moves(disturbed_pair(seed=seed), volts) for seed in (4, 5)}
    np.testing.assert_array_equal(again, first)
    assert np.abs((other - plain[5]) - (first - plain[4])).min() > 1e-8


def test_a_mirror_that_lags_rests_short_of_its_place_from_either_side() -> None:
    around = [(-60.0, -60.0), (0.0, 0.0), (60.0, 60.0), (0.0, 0.0)]
    tilts = tilts_after_moves(disturbed_pair(LAG), around)
    for number, role in enumerate(EYES):
        from_left_deg, from_right_deg = gazes_deg(tilts[[1, 3], number], role)
        np.testing.assert_allclose(from_right_deg - from_left_deg, 2.0 * LAG.hysteresis_deg, rtol=0.01)


def test_a_dead_axis_does_not_move_by_a_disturbance() -> None:
    pair = disturbed_pair(SCATTER)
    pair.dead_axes = set(MIRROR_AXES)
    pair.tilt_rad(Role.LEFT, 0)
    tilts = tilts_after_moves(pair, there_and_back(2))
    np.testing.assert_allclose(tilts, np.broadcast_to(tilts[0], tilts.shape), atol=1e-12)


def test_the_truth_of_a_rig_shows_the_disturbed_pose() -> None:
    volts = StereoVolts(left=MirrorVolts(x_v=30.0, y_v=20.0), right=MirrorVolts(x_v=30.0, y_v=20.0))
    apart_px = {}
    for name, disturbance in (("ideal", None), ("disturbed", MirrorDisturbance(scatter_rms_deg=0.05))):
        with open_simulated(inline=True, mirror_disturbance=disturbance) as rig:
            assert rig.truth is not None
            rig.mirrors.enable()
            actual = rig.mirrors.steer(volts)
            now_ns = rig.clock.now_ns() + MOVE_NS
            rig.clock.sleep_until_ns(now_ns)
            seen = rig.truth.projection(Role.LEFT, now_ns)
            law = rig.truth.static_projection(Role.LEFT, actual.left, t_ns=now_ns)
            far_m = 1e3 * law.direction(719.5, 539.5)[None]
            apart_px[name] = float(np.linalg.norm(seen.project(far_m)[0] - law.pixels(far_m)[0]))
    assert apart_px["ideal"] < 0.1  # steps of the DAC and of the tilts that are rendered
    assert 0.1 * 25.0 < apart_px["disturbed"] < 5.0 * 25.0  # 0.05 degrees are 25 px an axis


@pytest.mark.parametrize("angle_deg", [-0.001, 1.5, math.nan])
def test_an_impossible_disturbance_is_refused(angle_deg: float) -> None:
    with pytest.raises(ValidationError):
        MirrorDisturbance(scatter_rms_deg=angle_deg)
