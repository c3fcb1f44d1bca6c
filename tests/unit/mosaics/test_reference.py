"""References: triangulation over a rail's long baselines, on a painted plane whose depth is known."""

import csv
import json
from collections.abc import Iterator
from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.devices.rail_scenes import RISE, rail_scan
from tests.support.scenes.dataset_scenes import noise_texture, painted, plane_point, written
from tests.support.scenes.mosaic_scenes import Z_M, small_calibration

from foveacam_hardware.contract import Cancelled, InvalidInput, NotCalibrated
from foveacam_pipeline.capture.dataset import Dataset, check_dataset
from foveacam_pipeline.capture.dataset.reference_folder import (
    begin_reference,
    finish_reference,
    remove_unfinished_reference,
)
from foveacam_pipeline.capture.rail_stops import rail_stops
from foveacam_pipeline.capture.reference import (
    ReferenceSettings,
    WideBaselineReference,
    build_reference,
)
from foveacam_pipeline.capture.reference.adjust import adjust_rays
from foveacam_pipeline.capture.reference.compare import compare
from foveacam_pipeline.capture.reference.matching import SampleMatch
from foveacam_pipeline.capture.reference.rail_model import RailModel
from foveacam_pipeline.capture.reference.rays import Rays, linearize
from foveacam_pipeline.capture.reference.values import RailTrust, ReferenceSample
from foveacam_pipeline.capture.reference.views import FoveaView, fovea_views
from foveacam_server import cli

FEW = ReferenceSettings(across=6)
MATCHING_PX = 0.1
"""Standard error of a match, each axis."""


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return rail_scan(tmp_path_factory.mktemp("rail") / "raster")


@pytest.fixture(scope="module")
def reference(scan: Dataset) -> WideBaselineReference:
    return build_reference(scan, FEW)


def column(reference: WideBaselineReference, name: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([getattr(row, name) for row in reference.rows])


def rms(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_the_reference_is_nearer_to_the_truth_by_more_than_the_ratio_of_baselines(
    reference: WideBaselineReference,
) -> None:
    figures = reference.figures
    assert figures.referenced >= 20
    ratio = figures.baseline_m / figures.short_baseline_m
    assert ratio == pytest.approx(4.0, rel=1e-2)
    short, found = (column(reference, name) - Z_M for name in ("short_m", "reference_m"))
    assert rms(found) < rms(short) / ratio
    assert rms(found / column(reference, "sigma_m")) < 2.0
    assert set(column(reference, "views")) == {6.0}


def test_a_rail_that_is_not_along_the_rigs_x_is_found_out(reference: WideBaselineReference) -> None:
    assert len(reference.figures.stops) > 1
    for stop in reference.figures.stops:
        rise_m = stop.place_m[1]
        assert rise_m == pytest.approx(RISE * stop.rail_m, abs=3e-5)
        assert stop.place_m[0] == pytest.approx(stop.rail_m, abs=3.0 * max(stop.sigma_m[0], 1e-9))


def test_a_sample_is_a_place_of_its_own_left_fovea(scan: Dataset, reference: WideBaselineReference) -> None:
    calibration = small_calibration()
    volts = scan[1].pose.volts
    assert volts is not None
    look = fovea_views(scan, rail_stops(scan)[0], calibration, FEW)[2].look
    for row in reference.rows[:5]:
        u, v = look.plane(np.array([[row.x_px, row.y_px]]), 1.0 / Z_M)[0]
        assert np.arctan(u / calibration.fovea_f_px) == pytest.approx(row.ax_rad, abs=2e-6)
        assert np.arctan(v / calibration.fovea_f_px) == pytest.approx(row.ay_rad, abs=2e-6)


def test_slopes_are_those_of_the_residuals(scan: Dataset) -> None:
    rays, points, model = _rays(scan)
    unknowns = np.random.default_rng(1).normal(0.0, 0.1, len(model.sigmas))
    at = linearize(rays, points, model, unknowns)
    for k in range(model.first_view + 2):
        step = np.zeros_like(unknowns)
        step[k] = 1e-3
        there = linearize(rays, points, model, unknowns + step).residual_px - at.residual_px
        told = np.where(at.columns == k, 1.0, 0.0)[:, None, :] * at.by_unknowns
        assert there == pytest.approx(1e-3 * told.sum(axis=2), abs=1e-5)
    moved = linearize(rays, points + np.array([0.0, 0.0, 1e-5]), model, unknowns).residual_px - at.residual_px
    assert moved == pytest.approx(1e-5 * at.by_point[:, :, 2], abs=1e-5)


def test_a_ray_that_contradicts_the_others_is_left_out(scan: Dataset) -> None:
    rays, points, model = _rays(scan)
    wrong = rays.relative_px.copy()
    wrong[8] += [0.0, 5.0]
    found = adjust_rays(replace(rays, relative_px=wrong), points + 0.01, model, baseline_m=0.2)
    assert found.outliers >= 1
    assert not ((found.rays.sample == rays.sample[8]) & (found.rays.view == rays.view[8])).any()
    assert found.points_m == pytest.approx(points, abs=2e-4)


def test_references_scatter_as_far_as_they_say(scan: Dataset) -> None:
    calibration, rng, trials = small_calibration(), np.random.default_rng(2), 100
    stops, judged = rail_stops(scan)
    views = fovea_views(scan, stops, calibration, FEW)
    model = RailModel.of(
        stops, judged, views=len(views), trust=RailTrust(), calibration=calibration, depth_m=Z_M
    )
    ratios = []
    for _ in range(trials):
        points = rng.uniform([-0.05, -0.05, 5.0], [0.05, 0.05, 7.0], (2, 3))
        drawn = rng.standard_normal(len(model.sigmas))
        matches = [
            replace(each, relative_px=each.relative_px + rng.normal(0.0, MATCHING_PX, 2))
            for each in _exact(points, views, model, drawn)
        ]
        rays = Rays.of(matches, views, calibration, floor_px=1e-3)
        found = adjust_rays(rays, points + 0.01, model, baseline_m=0.2)
        ratios += ((found.points_m - points)[:, 2] / found.sigma_m).tolist()
    # Both samples share most of their error: 100 draws know a standard deviation to 7 %
    assert 0.8 <= float(np.sqrt(np.mean(np.square(ratios)))) <= 1.2
    assert np.mean(np.abs(ratios) <= 3.0) >= 0.99


def test_two_rays_alone_make_no_reference(scan: Dataset) -> None:
    rays, points, model = _rays(scan)
    two = rays.select(rays.view < 2)
    assert len(two) == 2 * len(points)
    assert np.isnan(adjust_rays(two, points, model, baseline_m=0.2).points_m).all()


def test_the_expected_error_grows_with_the_square_of_the_distance() -> None:
    rng = np.random.default_rng(2)
    f_b = 0.2 * 28_760.0
    rows = []
    for z in np.geomspace(2.0, 9.0, 400).tolist():
        short = 1.0 / (1.0 / z + rng.normal(0.0, 0.4) / f_b)
        rows.append(_row(short_m=short, reference_m=z))
    rows[7] = replace(rows[7], short_m=2.0 * rows[7].short_m)
    found = compare(rows, short_baseline_m=0.2, baseline_m=0.8, f_px=28_760.0)
    assert found.wrong == pytest.approx(1 / 400)
    assert found.disparity_rms_px == pytest.approx(0.4, rel=0.1)
    assert len(found.bins) == 8
    for each in found.bins:
        assert each.rms_m == pytest.approx(each.expected_short_m, rel=0.5)
        assert each.expected_reference_m == pytest.approx(each.expected_short_m / 4.0)


def test_a_reference_lies_beside_the_frames_and_the_index_stays(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    scan: Dataset,
    reference: WideBaselineReference,
) -> None:
    index = (scan.folder / "frames.csv").read_bytes()
    assert run(monkeypatch, str(scan.folder), "--across", "6", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    folder = Path(told["folder"])
    assert check_dataset(scan.folder) == []
    assert (scan.folder / "frames.csv").read_bytes() == index
    with (folder / "samples.csv").open(newline="") as file:
        read = [tuple(map(float, row.values())) for row in csv.DictReader(file)]
    assert read == [astuple(row) for row in reference.rows]
    assert told["referenced"] == told["comparison"]["samples"] == len(reference.rows)
    assert (folder / "comparison.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in (folder / "comparison.svg").read_bytes()
    assert json.loads((folder / "reference.json").read_text())["figures"]["referenced"] == len(reference.rows)
    with (folder / "samples.csv").open("a") as file:
        file.write("1,2\n")
    assert "reference/samples.csv: its content is not what was written" in check_dataset(scan.folder)[0]
    (folder / "reference.json").write_text("[]")
    assert any("make the reference again" in finding for finding in check_dataset(scan.folder))


def test_of_a_writer_that_was_ended_nothing_is_left_and_the_older_reference_is_there(tmp_path: Path) -> None:
    (begin_reference(tmp_path) / "samples.csv").write_text("older")
    finish_reference(tmp_path)
    for between_the_renames in (False, True):
        (begin_reference(tmp_path) / "samples.csv").write_text("newer")
        if between_the_renames:
            (tmp_path / "reference").rename(tmp_path / ".reference.older")
        remove_unfinished_reference(tmp_path)
        assert [path.name for path in tmp_path.iterdir()] == ["reference"]
        assert (tmp_path / "reference" / "samples.csv").read_text() == "older"


def test_what_makes_no_reference_is_refused_in_words(tmp_path: Path, scan: Dataset) -> None:
    with pytest.raises(NotCalibrated, match="no calibration"):
        build_reference(written(tmp_path / "bare", 2))
    point, _ = plane_point(0, aim_deg=(0.0, 0.0), z_m=5.0, texture=noise_texture(), rail_m=0.1)
    with pytest.raises(InvalidInput, match=r"two places on the rail or more; it has 1 scan from 100 mm"):
        build_reference(painted(tmp_path / "one", [point]))
    with pytest.raises(InvalidInput, match="views do not overlap"):
        build_reference(rail_scan(tmp_path / "apart", follow=-1.0), FEW)
    with pytest.raises(InvalidInput, match=r"has no scan 7 on the rail; its scans are \[0, 1, 2\]"):
        build_reference(scan, replace(FEW, scan=7))
    with pytest.raises(InvalidInput, match="2 to 40"):
        ReferenceSettings(across=1)


def test_a_frame_that_is_gone_is_named(tmp_path: Path) -> None:
    damaged = rail_scan(tmp_path / "raster")
    (damaged.folder / "images" / "00002-left-b0-s0.tiff").unlink()
    with pytest.raises(InvalidInput, match=r"00002-left-b0-s0\.tiff cannot be read"):
        build_reference(damaged, ReferenceSettings(across=3))


def test_a_cancelled_reference_writes_nothing(scan: Dataset) -> None:
    class Impatient:
        def progress(self, done: int, *, total: int, note: str = "") -> None:
            assert (done, total) == (1, 3)

        def cancelled(self) -> bool:
            return True

    with pytest.raises(Cancelled):
        build_reference(scan, FEW, watch=Impatient())


def test_the_command_refuses_without_a_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert run(monkeypatch, str(rail_scan(tmp_path / "one", stops_m=(0.1,)).folder)) == 2
    told = capsys.readouterr().err
    assert "two places on the rail" in told.strip().splitlines()[-1]
    assert "Traceback" not in told


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """Run `foveacam dataset reference` and return its exit status."""
    monkeypatch.setattr("sys.argv", ["foveacam", "dataset", "reference", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert isinstance(ended.value.code, int)
    return ended.value.code


def _rays(scan: Dataset) -> tuple[Rays, np.ndarray[tuple[int, int], np.dtype[np.float64]], RailModel]:
    """Return rays of made-up points, exact where the rail and the gazes are as told."""
    calibration = small_calibration()
    stops, judged = rail_stops(scan)
    views = fovea_views(scan, stops, calibration, FEW)
    model = RailModel.of(
        stops, judged, views=len(views), trust=RailTrust(), calibration=calibration, depth_m=Z_M
    )
    rng = np.random.default_rng(3)
    points = rng.uniform([-0.05, -0.05, 5.0], [0.05, 0.05, 7.0], (12, 3))
    exact = _exact(points, views, model, np.zeros(len(model.sigmas)))
    rays = Rays.of(list(exact), views, calibration, floor_px=0.05)
    return rays, points, model


def _exact(
    points: np.ndarray[tuple[int, int], np.dtype[np.float64]],
    views: list[FoveaView],
    model: RailModel,
    unknowns: np.ndarray[tuple[int], np.dtype[np.float64]],
) -> Iterator[SampleMatch]:
    """Yield what each view shows of points, for a rail, gazes and views that are off by their unknowns."""
    calibration = small_calibration()
    stop_poses = model.stop_poses(unknowns)
    looks_px = (unknowns * model.sigmas)[model.first_view :].reshape(-1, 2)
    for number, point in enumerate(points):
        for view in views:
            pose = stop_poses[view.stop]
            own = pose.to_stop_frame(point) - calibration.reference_rig_m(view.role)
            at_px = calibration.fovea_f_px * own[:2] / own[2]
            u, v = at_px - pose.shifts_px[view.eye] - looks_px[view.number]
            about = view.look.gaze_relative(np.asarray(u), np.asarray(v), np.asarray(1.0 / own[2]))
            yield SampleMatch(
                sample=number,
                view=view.number,
                relative_px=np.array(about),
                covariance=MATCHING_PX**2 * np.eye(2),
            )


def _row(*, short_m: float, reference_m: float) -> ReferenceSample:
    return ReferenceSample(
        point=0,
        right_point=0,
        x_px=0.0,
        y_px=0.0,
        ax_rad=0.0,
        ay_rad=0.0,
        short_m=short_m,
        short_sigma_m=0.01,
        short_pose_sigma_m=0.01,
        reference_m=reference_m,
        sigma_m=0.001,
        own_sigma_m=0.0005,
        views=4,
        stops=3,
        baseline_m=0.8,
        residual_px=0.1,
    )
