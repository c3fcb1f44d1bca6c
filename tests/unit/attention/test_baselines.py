from dataclasses import replace

import numpy as np
from tests.support.scenes.plane_head import CALIBRATION
from tests.unit.attention.states import unknown_state

from foveacam_bench.attention.baselines import (
    BySalience,
    ByUncertainty,
    RandomLooks,
    Raster,
    field_directions,
    spectral_residual,
)
from foveacam_bench.attention.maps import OTHERS, POLICY, Course, figures
from foveacam_pipeline.attention.field import FieldGrid
from foveacam_pipeline.attention.looks import Candidates
from foveacam_pipeline.attention.policy import Look
from foveacam_pipeline.verge.aim import EYES, reachable_eyes

GRID = FieldGrid.of(CALIBRATION.wide, context_cell_px=8)
CANDIDATES = Candidates(CALIBRATION, GRID)
STATE = unknown_state(len(GRID))


def test_directions_of_the_field_leave_no_gap_that_a_fovea_does_not_see() -> None:
    directions = field_directions(CALIBRATION)
    assert 30 < len(directions) < 120
    field_tan = CALIBRATION.fovea_width / CALIBRATION.fovea_f_px
    apart = np.linalg.norm(directions[:, None] - directions[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    assert apart.min(axis=1).max() < field_tan


def cells_about(x_px: float, y_px: float, reach_px: float) -> np.ndarray:
    """Return (n,) bool: the cells whose middles lie within a square about a wide pixel."""
    row, column = np.divmod(np.arange(len(GRID)), GRID.columns)
    middles_px = np.column_stack([column, row]) * GRID.cell_px + GRID.cell_px / 2
    return np.asarray((np.abs(middles_px - (x_px, y_px)) <= reach_px).all(axis=1))


def seen(look: Look | None) -> Look:
    assert look is not None
    assert look.meeting_m is not None
    assert reachable_eyes(CALIBRATION, look.gazes) == set(EYES)
    return look


def test_a_raster_shows_the_field_and_begins_anew() -> None:
    raster = Raster(CANDIDATES)
    looks = [seen(raster.choose(STATE)) for _ in range(len(field_directions(CALIBRATION)))]
    shown = np.any([look.cells for look in looks], axis=0)
    field = CANDIDATES.near_directions.any(axis=0)
    assert shown[field].mean() > 0.75
    assert (seen(raster.choose(STATE)).gazes.left == looks[0].gazes.left).all()


def test_uncertainty_looks_where_least_is_known_and_where_it_was_not_looked() -> None:
    sigma = np.full((len(GRID), 9), 0.001)
    unknown = cells_about(550.0, 650.0, 50.0)
    sigma[unknown] = np.inf
    look = seen(ByUncertainty(CANDIDATES).choose(replace(STATE, relative_sigma=sigma)))
    assert (look.cells & unknown).sum() > 0.8 * unknown.sum()


def test_salience_is_of_what_differs_and_falls_where_it_was_looked_at() -> None:
    picture = np.random.default_rng(2).integers(90, 110, (540, 720), dtype=np.uint8)
    picture[300:340, 400:450] = 250
    salience = spectral_residual(picture, (GRID.rows, GRID.columns))
    assert salience.shape == (len(GRID),)
    odd = cells_about(850.0, 640.0, 45.0)
    assert salience[odd].mean() > 4.0 * salience[~odd].mean()
    chooser = BySalience(CANDIDATES, salience)
    first = seen(chooser.choose(STATE))
    assert (first.cells & odd).any()
    later = replace(
        STATE, looked_s=np.where(first.cells, 99.0, -np.inf), tries=3 * first.cells.astype(np.int64)
    )
    assert (first.gazes.left != seen(chooser.choose(later)).gazes.left).any()


def test_random_looks_are_the_same_for_the_same_seed_and_reached() -> None:
    one, other = (RandomLooks(CANDIDATES, np.random.default_rng(7)) for _ in range(2))
    for _ in range(5):
        assert (seen(one.choose(STATE)).gazes.left == seen(other.choose(STATE)).gazes.left).all()


def test_times_are_to_nine_tenths_of_what_any_policy_measured() -> None:
    def course(shares: list[float]) -> Course:
        known = [np.arange(100) < round(100 * share) for share in shares]
        return Course(times_s=[1.0, 2.0, 3.0, 4.0], known=known, decided_ms=[2.0, 4.0])

    slow, fast = course([0.1, 0.2, 0.5, 0.7]), course([0.5, 0.75, 0.8, 0.8])
    found = figures({"a": {POLICY: fast, **dict.fromkeys(OTHERS, slow)}})
    assert found["map_time_ratio"] == 0.5  # 72 cells are known after 2 s; the other never knows them, in 4 s
    assert found["map_s_policy"] == 2.0
    assert found["known_fraction_raster"] == 70 / 80
    assert found["known_fraction_policy"] == 1.0
    assert found["policy_ms"] == 3.0
