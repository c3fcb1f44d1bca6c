"""A mosaic as a whole: what it shows, what it measures, that it can be ended and gone on with."""

import json
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.support.scenes.dataset_scenes import written
from tests.support.scenes.mosaic_scenes import SIDE, TEXEL_M, Z_M, scan, small_calibration, texture
from tests.support.scenes.network_graphs import constant, matcher, write_card

from foveacam_hardware.contract import Cancelled, InvalidInput, NotCalibrated, Role
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.mosaic.build import Mosaic, build_mosaic, chart_of
from foveacam_pipeline.capture.mosaic.chart import CELL
from foveacam_pipeline.capture.mosaic.fuse import fill_gaps, fuse
from foveacam_pipeline.capture.mosaic.values import MosaicSettings
from foveacam_pipeline.capture.mosaic.views import ViewPictureCache, mosaic_views
from foveacam_pipeline.capture.mosaic.wide import wide_view_of
from foveacam_pipeline.capture.mosaic.wide_depth import add_wide_depth
from foveacam_pipeline.networks.card import load_network
from foveacam_server import cli
from foveacam_server.resources.capturing.captures.dataset_cli import _mosaic_words


@pytest.fixture(scope="module")
def raster(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return scan(tmp_path_factory.mktemp("scan") / "raster", wide=True)


@pytest.fixture(scope="module")
def made(raster: Dataset, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Mosaic]:
    folder = tmp_path_factory.mktemp("made") / "mosaic"
    return folder, build_mosaic(raster, folder)


def test_the_plane_is_shown_as_it_is(made: tuple[Path, Mosaic]) -> None:
    folder, mosaic = made
    chart = mosaic.placed.chart
    overview = cv2.imread(str(folder / "overview.png"), cv2.IMREAD_GRAYSCALE)
    assert overview is not None
    assert overview.shape == (chart.height, chart.width)
    eye_x_m = small_calibration().reference_rig_m(Role.LEFT)[0]
    x, y = np.meshgrid(np.arange(chart.width), np.arange(chart.height))
    texel_x = ((x + chart.u0_px) / chart.f_px * Z_M + eye_x_m) / TEXEL_M + SIDE / 2
    texel_y = (y + chart.v0_px) / chart.f_px * Z_M / TEXEL_M + SIDE / 2
    truth = cv2.remap(
        texture(), texel_x.astype(np.float32), texel_y.astype(np.float32), cv2.INTER_CUBIC
    ).astype(int)
    inner = (slice(60, -60), slice(60, -60))
    wrong = np.abs(overview.astype(int) - truth)[inner]
    assert np.median(wrong) <= 4.0  # JPEG at quality 90, and two interpolations
    assert np.percentile(wrong, 99) <= 25.0


def test_seams_and_depth_are_measured(made: tuple[Path, Mosaic]) -> None:
    folder, mosaic = made
    figures = mosaic.figures
    assert figures.seams.links >= 20
    assert figures.seams.after_rms_px < 0.15
    assert not figures.seams.adjusted
    z_m = cv2.imread(str(folder / "depth.tiff"), cv2.IMREAD_UNCHANGED)
    assert z_m is not None
    assert z_m.shape == (figures.height // CELL, figures.width // CELL)
    known = z_m[np.isfinite(z_m)]
    assert known.size > 0.4 * z_m.size
    assert np.sqrt(np.mean((known / Z_M - 1.0) ** 2)) < 2e-3


@pytest.mark.parametrize("eye", [Role.LEFT, Role.RIGHT])
def test_where_stereo_has_no_depth_the_wide_view_tells(raster: Dataset, eye: Role) -> None:
    calibration, settings = small_calibration(), MosaicSettings(eye=eye)
    views, pictures = mosaic_views(raster, calibration, settings), ViewPictureCache(settings)
    chart = chart_of(views, calibration)
    wide = wide_view_of(raster, calibration, pictures, views[0])
    found = add_wide_depth(fuse(chart, []), views, pictures, chart=chart, wide=wide)
    assert np.isnan(found.per_depth).all()
    told = found.provisional[np.isfinite(found.provisional)]
    assert told.size > 0.5 * found.provisional.size
    assert np.median(np.abs(told * Z_M - 1.0)) < 0.02
    assert np.abs(np.median(found.filled) * Z_M - 1.0) < 0.02
    known = np.full_like(found.per_depth, 1.2 / Z_M)  # of stereo that sees the plane a fifth nearer
    known[: len(known) // 2] = np.nan
    contradicted = replace(found, per_depth=known, provisional=known, filled=fill_gaps(known))
    assert add_wide_depth(contradicted, views, pictures, chart=chart, wide=wide) is contradicted


def test_the_folder_says_what_it_holds(made: tuple[Path, Mosaic], raster: Dataset) -> None:
    folder, mosaic = made
    document = json.loads((folder / "mosaic.json").read_text())
    assert (document["format"], document["version"], document["state"]) == ("foveacam-mosaic", 1, "complete")
    assert document["recipe"]["dataset"] == raster.document.header.id
    assert f'Width="{mosaic.figures.width}"' in (folder / "mosaic.dzi").read_text()
    assert (folder / "cloud.ply").read_bytes().startswith(b"ply")
    assert not (folder / ".work").exists()


@dataclass
class EndsAfter:
    """Cancels when so many steps are over."""

    steps: int
    seen: list[tuple[int, int]] = field(default_factory=list)

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        self.seen.append((done, total))

    def cancelled(self) -> bool:
        return len(self.seen) >= self.steps


def test_a_mosaic_that_was_cancelled_is_gone_on_with_and_comes_out_the_same(
    made: tuple[Path, Mosaic], raster: Dataset, tmp_path: Path
) -> None:
    folder = tmp_path / "again"
    with pytest.raises(Cancelled, match="go on"):
        build_mosaic(raster, folder, watch=EndsAfter(2))
    assert json.loads((folder / "mosaic.json").read_text())["state"] == "running"
    assert len(list((folder / ".work").glob("*.npz"))) >= 2
    watch = EndsAfter(1_000_000)
    build_mosaic(raster, folder, watch=watch)
    done = [count for count, _ in watch.seen]
    assert done == sorted(done)
    assert watch.seen[-1][0] == watch.seen[-1][1]
    for name in ("overview.png", "depth.tiff", "cloud.ply", "mosaic.json"):
        assert (folder / name).read_bytes() == (made[0] / name).read_bytes()


def test_a_network_computes_the_depth_of_the_pairs_and_the_mosaic_says_so(
    raster: Dataset, tmp_path: Path
) -> None:
    network = load_network(write_card(matcher(tmp_path / "a.onnx", first_px=-32, last_px=32)))
    made = build_mosaic(raster, tmp_path / "made", MosaicSettings(network=network))
    matching = made.figures.matching
    assert (matching.backend, matching.sha256, matching.failed_pairs) == ("shifts", network.card.sha256, 0)
    document = json.loads((tmp_path / "made" / "mosaic.json").read_text())
    assert document["recipe"]["network_sha256"] == network.card.sha256
    z_m = made.placed.depth.z_m
    known = z_m[np.isfinite(z_m)]
    assert known.size > 0.3 * z_m.size and abs(float(np.median(known)) / Z_M - 1.0) < 0.01
    with pytest.raises(InvalidInput, match="something else"):
        build_mosaic(raster, tmp_path / "made")


def test_pairs_that_the_network_fails_on_are_matched_and_counted(
    made: tuple[Path, Mosaic], raster: Dataset, tmp_path: Path
) -> None:
    network = load_network(write_card(constant(tmp_path / "nan.onnx", float("nan")), name="broken"))
    found = build_mosaic(raster, tmp_path / "made", MosaicSettings(network=network))
    failed = found.figures.matching.failed_pairs
    assert f"by broken ({failed} pairs, on which it failed, by sgbm)" in _mosaic_words(found.figures)
    assert failed >= len(raster)
    assert (tmp_path / "made" / "depth.tiff").read_bytes() == (made[0] / "depth.tiff").read_bytes()


def test_another_mosaic_or_a_foreign_folder_is_not_overwritten(
    made: tuple[Path, Mosaic], raster: Dataset, tmp_path: Path
) -> None:
    with pytest.raises(InvalidInput, match="something else"):
        build_mosaic(raster, made[0], MosaicSettings(eye=Role.RIGHT))
    (tmp_path / "letters.txt").write_text("mine")
    with pytest.raises(InvalidInput, match="something else"):
        build_mosaic(raster, tmp_path)


def test_what_cannot_be_made_is_refused(raster: Dataset, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="left or the right eye"):
        MosaicSettings(eye=Role.WIDE)
    with pytest.raises(InvalidInput, match="no left frame of bracket 3"):
        build_mosaic(raster, tmp_path / "a", MosaicSettings(bracket=3))
    with pytest.raises(InvalidInput, match="no scan 7"):
        build_mosaic(raster, tmp_path / "b", MosaicSettings(scan=7))
    with pytest.raises(NotCalibrated):
        build_mosaic(written(tmp_path / "noise", 1), tmp_path / "c")
    assert not (tmp_path / "a").exists()


def test_the_command_makes_a_mosaic_with_a_mesh(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], raster: Dataset, tmp_path: Path
) -> None:
    folder = tmp_path / "mosaic"
    words = ["foveacam", "dataset", "mosaic", str(raster.folder), str(folder), "--json"]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 0
    assert json.loads(capsys.readouterr().out)["seams"]["links"] > 0
    assert (folder / "mesh.glb").read_bytes()[:4] == b"glTF"


def test_a_mosaic_without_overlap_says_so_and_gives_valid_json(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    alone = scan(tmp_path / "raster", points=1).folder
    words = ["foveacam", "dataset", "mosaic", str(alone), str(tmp_path / "mosaic")]
    told = []
    for more in ([], ["--json"]):
        monkeypatch.setattr("sys.argv", [*words, *more])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        assert ended.value.code == 0
        told.append(capsys.readouterr().out)
    assert "from 1 fovea, no overlap in which a seam could be measured, depth of" in told[0]
    assert "NaN" not in told[1]
    assert json.loads(told[1])["seams"]["after_rms_px"] is None
