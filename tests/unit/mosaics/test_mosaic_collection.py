"""Mosaics on the disk: one that is whole, one in the making; where one stands to look at it."""

import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.mosaic.chart import Chart
from foveacam_pipeline.capture.mosaic.depth_tiles import write_depth_tiles
from foveacam_pipeline.capture.mosaic.folder import MosaicFolder
from foveacam_pipeline.capture.mosaic.values import DepthFigures, MosaicFigures, MosaicSettings, SeamFigures
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.capturing.mosaics.collection import DepthTilesFile, MosaicCollection
from foveacam_server.resources.capturing.mosaics.service import viewpoint_of

CHART = Chart(u0_px=-500, v0_px=100, width=4000, height=3000, f_px=28760.0)
SEAMS = SeamFigures(
    links=0,
    rejected=0,
    before_rms_px=math.nan,
    after_rms_px=math.nan,
    measuring_rms_px=math.nan,
    adjusted=False,
    largest_shift_px=0.0,
    largest_gain_percent=0.0,
)
DEPTH = DepthFigures(
    known=0.0, seen_twice=0.0, between_pairs_rel_rms=math.nan, outliers=0.0, median_sigma_rel=math.nan
)
FIGURES = MosaicFigures(width=4000, height=3000, views=2, tiles=7, seams=SEAMS, depth=DEPTH)


def make(folder: Path, *, eye: Role) -> None:
    recipe: dict[str, object] = {"settings": asdict(MosaicSettings(eye=eye)), "chart": asdict(CHART)}
    folder.mkdir(parents=True)
    MosaicFolder(path=folder, recipe=recipe).finish(FIGURES)
    write_depth_tiles(folder, np.full((1, 1), np.nan, dtype=np.float32))


def eye_of(shelf: MosaicCollection) -> str:
    return shelf.require("cap-1").file.recipe.settings.eye


def test_what_is_half_made_is_not_shown_and_what_is_finished_takes_its_place(tmp_path: Path) -> None:
    shelf = MosaicCollection(tmp_path / ".mosaics")
    make(shelf.prepare("cap-1"), eye=Role.LEFT)
    assert shelf.made("cap-1") is None
    with pytest.raises(NotFound, match="has no mosaic"):
        shelf.tile("cap-1", "picture", level=0, column=0, row=0)
    shelf.finish("cap-1")
    make(shelf.prepare("cap-1"), eye=Role.RIGHT)
    assert eye_of(shelf) == "left"
    shelf.finish("cap-1")
    assert eye_of(shelf) == "right"
    assert [path.name for path in shelf.home("cap-1").iterdir()] == ["made"]
    shelf.remove("cap-1")
    assert shelf.made("cap-1") is None
    assert list(shelf.folder.iterdir()) == []


@pytest.mark.parametrize("capture_id", ["..", ".", "../../etc", "/etc", "a/b", "a\x00b", "ü", "x" * 99, " "])
def test_whatever_an_id_looks_like_its_folder_lies_in_that_of_the_mosaics(
    capture_id: str, tmp_path: Path
) -> None:
    home = MosaicCollection(tmp_path).home(capture_id)
    assert home.parent == tmp_path
    assert home.name.isascii()
    assert home.resolve().parent == tmp_path.resolve()


@pytest.mark.parametrize(("near_m", "far_m"), [(2.8, 8.3), (5.9, 6.1), (0.4, 30.0)])
def test_one_looks_at_a_field_from_before_its_nearest_end(near_m: float, far_m: float) -> None:
    depth = DepthTilesFile(
        width=500, height=375, cell_px=8, tile_px=512, step_m=1e-4, near_m=near_m, far_m=far_m
    )
    stand, middle = viewpoint_of(CHART, depth)
    assert stand[2] < near_m
    assert middle[2] == pytest.approx((near_m + far_m) / 2)
    assert middle[0] == pytest.approx(middle[2] * 1500 / 28760)
