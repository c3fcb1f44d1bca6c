"""The lens of a fovea by views of a small board: as exact as it says, refused where they tell too little."""

import numpy as np
import pytest
from tests.support.scenes.board_scenes import DivisionLens, Pose, board_samples

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.wide.boards import Charuco
from foveacam_pipeline.calibrate.wide.fit_fovea import FoveaFit, fit_fovea
from foveacam_pipeline.calibrate.wide.wide_samples import WideSamples

BOARD = Charuco(square_m=0.012, marker_m=0.009)
FOCAL_PX = 28_760.0
LENS = DivisionLens(focal_px=FOCAL_PX, centre_px=(731.0, 530.0), bend=-1.5)
NOISE_PX = 0.03


def poses(count: int, rng: np.random.Generator, *, max_tilt_rad: float = 0.75) -> list[Pose]:
    """Poses of a board of 120 mm that fill the field of a fovea at 2.5 to 3.5 m."""
    found = []
    for _ in range(count):
        depth_m = float(rng.uniform(2.5, 3.5))
        x, y = (rng.uniform(-0.012, 0.012, 2) * depth_m).tolist()
        turn = rng.uniform(-max_tilt_rad, max_tilt_rad, 3) * np.array([1.0, 1.0, 0.4])
        found.append(Pose(place_m=(x, y, depth_m), turn_rad=(turn[0], turn[1], turn[2])))
    return found


def views(
    count: int = 20, *, seed: int = 1, max_tilt_rad: float = 0.75, lens: DivisionLens = LENS
) -> WideSamples:
    shown = poses(count, np.random.default_rng(seed), max_tilt_rad=max_tilt_rad)
    samples = board_samples(BOARD, shown, lens=lens, noise_px=NOISE_PX, seed=seed)
    return WideSamples(BOARD, samples, role=Role.LEFT)


def by_name(fit: FoveaFit) -> dict[str, tuple[float, float, bool]]:
    return {each.name: (each.value, each.sigma, each.assumed) for each in fit.parameters}


def test_focal_length_is_found_within_what_the_fit_says() -> None:
    pulls = []
    for seed in range(12):
        value, sigma, assumed = by_name(fit_fovea(views(seed=seed)))["fx_px"]
        assert not assumed
        assert sigma < 0.01 * FOCAL_PX
        pulls.append((value - FOCAL_PX) / sigma)

    assert np.abs(pulls).max() < 3.0
    assert np.sqrt(np.mean(np.square(pulls))) < 1.5


def test_three_views_do_not_claim_more_than_they_tell() -> None:
    pulls = []
    for seed in range(20):
        try:
            value, sigma, _ = by_name(fit_fovea(views(3, seed=seed, max_tilt_rad=0.6)))["fx_px"]
        except InvalidInput:
            continue
        pulls.append((value - FOCAL_PX) / sigma)

    assert len(pulls) >= 12
    assert np.abs(pulls).max() < 3.0


@pytest.mark.parametrize("focal_px", [10_000.0, 14_380.0, 57_520.0])
def test_another_telephoto_lens_is_found_as_well(focal_px: float) -> None:
    lens = DivisionLens(focal_px=focal_px, centre_px=(719.5, 539.5), bend=0.0)
    scale = focal_px / FOCAL_PX
    shown = [
        Pose(place_m=(x, y, scale * z), turn_rad=pose.turn_rad)
        for pose in poses(20, np.random.default_rng(3))
        for x, y, z in [pose.place_m]
    ]
    samples = WideSamples(BOARD, board_samples(BOARD, shown, lens=lens, noise_px=0.02), role=Role.RIGHT)
    value, sigma, _ = by_name(fit_fovea(samples))["fx_px"]

    assert abs(value - focal_px) < 3.0 * sigma < 0.03 * focal_px


def test_what_the_views_do_not_tell_is_assumed_and_unsure() -> None:
    straight = DivisionLens(focal_px=FOCAL_PX, centre_px=(719.5, 539.5), bend=0.0)
    fit = fit_fovea(views(4, lens=straight, max_tilt_rad=0.5))
    found = by_name(fit)

    assert [name for name in ("k2", "p1", "p2", "k3") if not found[name][2]] == []
    assert not found["fx_px"][2]
    assert "assumed: " in fit.reason
    assert found["cx_px"][1] > 5.0


def test_field_of_view_is_that_of_the_lens() -> None:
    width_rad, height_rad = fit_fovea(views()).lens.field_rad
    assert np.degrees(width_rad) == pytest.approx(2.868, abs=0.02)
    assert np.degrees(height_rad) == pytest.approx(2.151, abs=0.02)


def test_views_of_a_board_that_was_not_tilted_are_refused() -> None:
    with pytest.raises(
        InvalidInput, match=r"left calibration: 8 views leave the focal length unsure .* tilt it"
    ):
        fit_fovea(views(8, max_tilt_rad=0.02))


def test_two_views_are_refused() -> None:
    with pytest.raises(InvalidInput, match="2 views of the board, at least 3 are needed"):
        fit_fovea(views(2))
