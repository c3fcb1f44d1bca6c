"""Where a fitted lens ends: its directions beyond are of no use, and its file says so."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from foveacam_hardware.contract import OutOfRange
from foveacam_pipeline.calibrate.wide.lens_accuracy import GRID, LensAccuracy, grid_px, kept_to_useful
from foveacam_pipeline.models import load_calibration, save_calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

LENS = Intrinsics(width=640, height=480, fx_px=500.0, fy_px=500.0, cx_px=319.5, cy_px=239.5)


def accuracy(*, beyond_px: float) -> LensAccuracy:
    """Return an accuracy of 0.1 px up to a radius, 200 px beyond."""
    radius = np.hypot(*(grid_px(640, 480) - [319.5, 239.5]).T)
    return LensAccuracy(
        sigma_px=60.0,
        sigma_rad=0.1,
        map_px=np.where(radius > beyond_px, 200.0, 0.1).reshape(GRID[1], GRID[0]),
        known_fraction=1.0,
        covariance=np.eye(9),
    )


def test_a_lens_ends_where_its_directions_are_of_no_use() -> None:
    kept, stated = kept_to_useful(LENS, accuracy(beyond_px=350.0))
    assert kept.known_tan == pytest.approx(350.0 / 500.0, abs=0.05)
    assert stated.sigma_px == pytest.approx(0.1)
    assert 0.7 < stated.known_fraction < 1.0
    assert np.isnan(kept.angles_rad([(0.0, 0.0)])).all()
    assert np.isfinite(kept.angles_rad([(319.5, 0.0)])).all()
    assert np.isnan(kept.pixels([(0.6, 0.5)])).all()
    assert kept.binned(2).known_tan == kept.known_tan
    with pytest.raises(OutOfRange, match="is not known well enough"):
        kept.check_pixel(1.0, 1.0)


def test_a_lens_that_is_known_everywhere_has_no_end() -> None:
    everywhere = accuracy(beyond_px=1000.0)
    assert kept_to_useful(LENS, everywhere) == (LENS, everywhere)


def test_the_end_is_stored_and_a_lens_without_one_keeps_its_id(tmp_path: Path) -> None:
    shipped = load_calibration(SHIPPED / "sim-rig120.json")
    assert f'"{shipped.id}' in (SHIPPED / "sim-rig120.json").read_text()
    ending = replace(shipped, wide=replace(shipped.wide, known_tan=0.2))
    save_calibration(ending, tmp_path / "ending.json")
    back = load_calibration(tmp_path / "ending.json")
    assert back.wide.known_tan == 0.2
    assert back.id == ending.id != shipped.id
