"""Mosaics on the disk: one that is whole, one in the making; where one stands to look at it."""

import json
from pathlib import Path

import pytest

from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.mosaics.collection import MosaicCollection, StoredMosaic
from foveacam_server.resources.mosaics.documents import viewpoint_of

CHART = {"u0_px": -500, "v0_px": 100, "width": 4000, "height": 3000, "f_px": 28760.0}


def make(folder: Path, *, eye: str) -> None:
    folder.mkdir(parents=True)
    document = {"recipe": {"settings": {"eye": eye}, "chart": CHART}}
    (folder / "mosaic.json").write_text(json.dumps(document))
    (folder / "depth_tiles.json").write_text("{}")


def test_what_is_half_made_is_not_shown_and_what_is_finished_takes_its_place(tmp_path: Path) -> None:
    shelf = MosaicCollection(tmp_path / ".mosaics")
    make(shelf.prepare("cap-1"), eye="left")
    assert shelf.made("cap-1") is None
    with pytest.raises(NotFound, match="has no mosaic"):
        shelf.tile("cap-1", "picture", level=0, column=0, row=0)
    shelf.finish("cap-1")
    make(shelf.prepare("cap-1"), eye="right")
    assert shelf.require("cap-1").document["recipe"]["settings"]["eye"] == "left"
    shelf.finish("cap-1")
    assert shelf.require("cap-1").document["recipe"]["settings"]["eye"] == "right"
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
def test_one_looks_at_a_field_from_before_its_nearest_end(
    near_m: float, far_m: float, tmp_path: Path
) -> None:
    kept = StoredMosaic(
        folder=tmp_path,
        document={"recipe": {"chart": CHART}},
        depth={"near_m": near_m, "far_m": far_m},
        size_bytes=0,
        made_ns=0,
    )
    stand, middle = viewpoint_of(kept)
    assert stand[2] < near_m
    assert middle[2] == pytest.approx((near_m + far_m) / 2)
    assert middle[0] == pytest.approx(middle[2] * 1500 / 28760)
