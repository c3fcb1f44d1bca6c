"""Binned frames in datasets and recordings: their binning comes back, and exports and depth follow it."""

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.binned_head import binned_frame, binned_sighting
from tests.support.scenes.dataset_scenes import CALIBRATION, header, noise_frame, written
from tests.support.scenes.plane_head import PlaneHead, noise_texture
from tests.support.scenes.recordings import SESSION

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.capture.dataset import CapturedPoint, Dataset, DatasetWriter, PlanPosition, Shot
from foveacam_pipeline.capture.dataset.export.authors import windows_of
from foveacam_pipeline.capture.dataset.export.views import fovea_views, wide_view
from foveacam_pipeline.capture.dataset.journal import JOURNAL, first_digest, journal_line, read_journal
from foveacam_pipeline.capture.dataset.values import FrameRecord, PointRecord
from foveacam_pipeline.capture.recording.observations import observation_of
from foveacam_pipeline.capture.recording.poses import raw_frame
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.recorder import Recorder
from foveacam_pipeline.capture.recording.session import RigDescription
from foveacam_pipeline.capture.recording.statistics import FrameLoss
from foveacam_pipeline.verge.aim import aim_at, volts_for


@pytest.fixture(scope="module")
def look() -> Sighting:
    gazes = aim_at(CALIBRATION, np.array([0.02, -0.03]), 1.0 / 6.0)
    found = PlaneHead(z_m=6.0, texture=noise_texture()).look(volts_for(CALIBRATION, gazes))
    return replace(found, right=replace(found.right, volts=found.volts.right))


def dataset_of(folder: Path, look: Sighting) -> Dataset:
    shots = tuple(Shot(frame=frame) for frame in (look.left, look.right, look.wide))
    with DatasetWriter.create(folder, header(1, calibration=CALIBRATION)) as writer:
        writer.add(CapturedPoint(place=PlanPosition(index=0), shots=shots))
        writer.finish()
    return Dataset.open(folder)


def test_a_dataset_gives_binned_frames_and_the_same_pairs(tmp_path: Path, look: Sighting) -> None:
    full, half = (
        dataset_of(tmp_path / "full", look)[0],
        dataset_of(tmp_path / "half", binned_sighting(look))[0],
    )
    assert (half.frame(Role.LEFT).binning, half.stacked(Role.WIDE).binning) == (2, 2)
    assert {record.binning for record in full.frames} == {1}
    one, other = full.rectified(), half.rectified()
    assert (one.f_px, one.u0_left_px) == pytest.approx((other.f_px, other.u0_left_px))
    assert np.abs(one.left.astype(int) - other.left)[one.valid_left & other.valid_left].max() <= 1
    index = (tmp_path / "half" / "frames.csv").read_text().splitlines()
    assert index[0].endswith(",binning") and index[1].endswith(",2")


def test_exports_of_binned_frames_have_the_camera_of_their_pixels(tmp_path: Path, look: Sighting) -> None:
    full, half = (
        dataset_of(tmp_path / "full", look)[0],
        dataset_of(tmp_path / "half", binned_sighting(look))[0],
    )
    wide = wide_view(half, CALIBRATION)
    assert wide.image.shape == (540, 720)
    assert wide.camera.f_px == pytest.approx(wide_view(full, CALIBRATION).camera.f_px / 2.0)
    for one, other in zip(
        fovea_views(full, CALIBRATION, scale=0.5), fovea_views(half, CALIBRATION, scale=0.5), strict=True
    ):
        assert one.camera == other.camera
        assert np.abs(one.image.astype(int) - other.image)[20:-20, 20:-20].max() <= 2
    windows = [
        windows_of(CALIBRATION, seen.left, seen.right, seen.volts)[0]
        for seen in (look, binned_sighting(look))
    ]
    assert windows[0].image.shape == windows[1].image.shape == (1080, 1440)
    assert windows[0].u0_px == windows[1].u0_px
    apart = windows[0].image.astype(float)[400:600, 500:900] - windows[1].image[400:600, 500:900]
    assert abs(float(apart.mean())) < 0.5 * 256.0
    assert float(apart.std()) < 3.0 * 256.0  # noise; half a pixel of displacement would be more


def test_a_journal_of_before_binning_reads_as_binning_one(tmp_path: Path) -> None:
    record = PointRecord(
        place=PlanPosition(index=0),
        frames=tuple(frame for point in written(tmp_path / "raster", 1) for frame in point.frames),
    )
    line, _ = journal_line(record, first_digest("test"))
    text = json.loads(line[33:])
    for frame in text["frames"]:
        del frame["binning"]
    (tmp_path / JOURNAL).write_bytes(_line_of(text))
    read = read_journal(tmp_path, dataset_id="test")
    assert not read.torn
    assert {frame.binning for frame in read.records[0].frames} == {1}
    assert isinstance(read.records[0].frames[0], FrameRecord)


def _line_of(document: object) -> bytes:
    text = json.dumps(document, separators=(",", ":"))
    digest = hashlib.sha256(f"{first_digest('test')} {text}".encode()).hexdigest()[:32]
    return f"{digest} {text}\n".encode()


def test_a_recording_gives_binned_observations(tmp_path: Path, look: Sighting) -> None:
    half = binned_sighting(look)
    rig = RigDescription(
        rig_id=CALIBRATION.rig_id,
        name="test",
        baseline_m=CALIBRATION.baseline_m,
        calibration=CALIBRATION,
    )
    path = tmp_path / "a.fcap"
    with Recorder(path, replace(SESSION, rig=rig)) as recorder:
        for frame in (half.left, half.right):
            assert recorder.publish(frame.role.value, raw_frame(frame, calibration=CALIBRATION))
    with Recording(path) as recording:
        pair = tuple(recording.frame(role.value, 0) for role in (Role.LEFT, Role.RIGHT))
        assert {frame.binning for frame in pair} == {2}
        seen, calibration = observation_of(recording, (pair[0], pair[1]))
        assert (seen.left.binning, seen.right.binning) == (2, 2)
        assert calibration.fovea_width == 1440


def test_frames_of_another_binning_are_refused_midway_and_counted(tmp_path: Path) -> None:
    frame = noise_frame(Role.LEFT, 0)
    path = tmp_path / "a.fcap"
    with Recorder(path, SESSION) as recorder:
        assert recorder.publish("left", raw_frame(frame))
        assert not recorder.publish("left", raw_frame(replace(binned_frame(frame), seq=1)))
        assert not recorder.publish("left", raw_frame(replace(frame, binning=2, seq=2)))
        counts = recorder.statistics["left"]
    assert counts.losses[FrameLoss.FORMAT] == 2
    with Recording(path) as recording:
        assert len(recording.stream("left")) == 1
