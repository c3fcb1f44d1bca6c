"""Exports of a recording as an array, as numbered pictures, and without the lens' distortion."""

import csv
import io
import zipfile
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.support.scenes.dataset_scenes import CALIBRATION
from tests.support.scenes.recordings import SESSION, picture, raw, record

from foveacam_hardware.contract import Image, InvalidInput
from foveacam_pipeline.capture.recording.movie import MovieSpec, export_movie
from foveacam_pipeline.capture.recording.pixels import as_image
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.recorder import Recorder
from foveacam_pipeline.capture.recording.sequences import export_npy, export_png
from foveacam_pipeline.capture.recording.session import RigDescription
from foveacam_pipeline.models.intrinsics import Intrinsics

LENS = Intrinsics(
    width=32, height=24, fx_px=30.0, fy_px=30.0, cx_px=15.5, cy_px=11.5, distortion=(0.4, 0.0, 0.0, 0.0, 0.0)
)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sequence") / "a.fcap"
    rig = RigDescription(rig_id="r", name="r", baseline_m=0.2, calibration=replace(CALIBRATION, wide=LENS))
    record(path, rig=rig)
    return path


def pictures(archive: zipfile.ZipFile) -> list[Image]:
    names = [name for name in archive.namelist() if name.endswith(".png")]
    found = list[Image]()
    for name in names:
        image = cv2.imdecode(np.frombuffer(archive.read(name), np.uint8), cv2.IMREAD_UNCHANGED)
        assert image is not None
        found.append(as_image(image))
    return found


def test_an_array_holds_every_frame_as_it_was_recorded(recording: Path, tmp_path: Path) -> None:
    done: list[tuple[int, int]] = []
    with Recording(recording) as opened:
        count = export_npy(
            opened, MovieSpec(show="left"), tmp_path / "a.npy", progress=lambda *far: done.append(far)
        )
    array = np.load(tmp_path / "a.npy")

    assert (count, array.shape, array.dtype, done[-1]) == (6, (6, 24, 32), np.uint8, (6, 6))
    for tick in range(6):
        np.testing.assert_array_equal(array[tick], picture("left", tick))


def test_twelve_bits_and_a_part_of_the_time_stay_as_they_are(tmp_path: Path) -> None:
    deep = np.random.default_rng(4).integers(0, 4096, (5, 5, 7), dtype=np.uint16)
    with Recorder(tmp_path / "a.fcap", SESSION) as recorder:
        for tick, image in enumerate(deep):
            recorder.publish("left", raw(image, tick=tick, bits=12, packed=True))
    with Recording(tmp_path / "a.fcap") as opened:
        export_npy(opened, MovieSpec(show="left", start_s=0.02, end_s=0.08), tmp_path / "a.npy")
        export_png(opened, MovieSpec(show="left"), tmp_path / "a.zip")

    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), deep[1:4])
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        np.testing.assert_array_equal(pictures(archive), deep)


def test_pictures_come_with_their_times_and_poses(recording: Path, tmp_path: Path) -> None:
    with Recording(recording) as opened:
        assert export_png(opened, MovieSpec(show="side-by-side"), tmp_path / "a.zip") == 6
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        shown = pictures(archive)
        rows = list(csv.DictReader(io.StringIO(archive.read("frames.csv").decode())))

    assert [image.shape for image in shown] == [(24, 64, 3)] * 6
    assert [(row["picture"], row["stream"]) for row in rows[:3]] == [
        ("000000.png", "left"),
        ("000000.png", "right"),
        ("000001.png", "left"),
    ]
    assert float(rows[2]["t_s"]) == pytest.approx(0.02)
    assert (float(rows[2]["x_v"]), float(rows[2]["exposure_ms"])) == (2.5, 4.0)
    assert (float(rows[2]["ax_deg"]), float(rows[2]["ay_deg"])) == pytest.approx((0.572958, -1.145916))


def test_straight_lines_are_straight_again_in_the_wide_picture_alone(recording: Path, tmp_path: Path) -> None:
    with Recording(recording) as opened:
        export_npy(opened, MovieSpec(show="center", undistorted=True), tmp_path / "a.npy")
        export_movie(opened, MovieSpec(show="center", undistorted=True), tmp_path / "a.mp4")
        with pytest.raises(InvalidInput, match="only the wide camera's lens is known"):
            export_npy(opened, MovieSpec(show="left", undistorted=True), tmp_path / "b.npy")
    expected = cv2.undistort(picture("center", 2), LENS.matrix, np.array(LENS.distortion))

    array = np.load(tmp_path / "a.npy")
    assert np.abs(array[2].astype(int) - expected).max() <= 1
    assert np.abs(array[2].astype(int) - picture("center", 2)).max() > 5


def test_a_recording_that_tells_no_lens_is_exported_as_taken_alone(tmp_path: Path) -> None:
    record(tmp_path / "a.fcap")
    with Recording(tmp_path / "a.fcap") as opened, pytest.raises(InvalidInput, match="contains no lens"):
        export_movie(opened, MovieSpec(show="center", undistorted=True), tmp_path / "a.mp4")


@pytest.mark.parametrize(("name", "export"), [("a.npy", export_npy), ("a.zip", export_png)])
def test_one_that_is_interrupted_leaves_nothing(
    recording: Path, tmp_path: Path, name: str, export: type[object]
) -> None:
    def interrupt(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with Recording(recording) as opened, pytest.raises(KeyboardInterrupt):
        export(opened, MovieSpec(show="left"), tmp_path / name, progress=interrupt)  # type: ignore[call-arg]  # either
    assert list(tmp_path.iterdir()) == []


def test_an_array_holds_no_two_eyes(recording: Path, tmp_path: Path) -> None:
    with Recording(recording) as opened, pytest.raises(InvalidInput, match="an array holds one stream"):
        export_npy(opened, MovieSpec(show="anaglyph"), tmp_path / "a.npy")
    assert list(tmp_path.iterdir()) == []
