"""One moment of a recording: outlines, red and cyan, and depth from its own poses and calibration."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.dataset_scenes import CALIBRATION
from tests.support.scenes.recorded_looks import PERIOD_S, Z_M, look
from tests.support.scenes.recordings import BEGIN_NS, PERIOD_NS, picture, raw, record

from foveacam_hardware.contract import InvalidInput, NotCalibrated, Role
from foveacam_pipeline.capture.recording.observations import observation_of
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.recorder import Recorder
from foveacam_pipeline.capture.recording.session import RIG, RecordingSession, RigDescription, read_wide_lens
from foveacam_pipeline.capture.recording.values import FramePose, TrackedBox
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.estimator import BACKENDS, DepthEstimator
from foveacam_pipeline.stereo.pictures import AnaglyphStyle
from foveacam_pipeline.stereo.values import DepthMap
from foveacam_server.resources.capturing.recordings.depth import DepthOrder, RecordedDepthService, centre_of
from foveacam_server.resources.capturing.recordings.moments import (
    anaglyph,
    difference,
    frame_time_s,
    moment_document,
    pair_at,
    timeline_document,
)
from foveacam_server.resources.capturing.recordings.opened import OpenRecordings


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return look(tmp_path_factory.mktemp("looks") / "plane.fcap")


class BuiltIn:
    """The backends that need no network."""

    def open(self, name: str, *, research_confirmed: bool) -> tuple[DepthEstimator, str | None]:
        assert not research_confirmed
        return {str(built_in): found for built_in, found in BACKENDS.items()}[name], None


@pytest.fixture
def desk() -> Iterator[RecordedDepthService]:
    opened = OpenRecordings()
    yield RecordedDepthService(opened, BuiltIn())
    opened.close()


def centre(corners: Sequence[Sequence[float]]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.asarray(np.mean(np.array(corners), axis=0))


def test_a_moment_has_the_nearest_frame_of_every_camera_and_where_the_foveae_look(seen: Path) -> None:
    with Recording(seen) as recording:
        found = moment_document(recording, "rec-1", t_s=0.09)
        line = timeline_document(recording)
        late = frame_time_s(recording, Role.RIGHT, -1)
    frames = found.frames
    aim = np.tan(np.deg2rad([2.0, -1.0]))

    assert [frame.index for frame in frames.values()] == [1, 1, 1]
    assert frames["wide"].t_s == PERIOD_S
    assert frames["left"].t_s == pytest.approx(PERIOD_S + 0.01)
    assert late == pytest.approx(PERIOD_S + 0.01)
    assert next(stream.t_s for stream in line.streams) == [0.0, PERIOD_S]
    assert line.calibrated is True
    assert found.meeting_m == pytest.approx(Z_M * np.linalg.norm([*aim, 1.0]), rel=1e-3)
    expected = CALIBRATION.wide.pixels(np.deg2rad([[2.0, -1.0]]))[0]
    for frame in (frames["left"], frames["right"]):
        np.testing.assert_allclose(centre(frame.footprint_px or []), expected, atol=8.0)
    assert frames["wide"].footprint_px is None
    assert frames["left"].jpeg_url.endswith("/rec-1/frames/left/1.jpg")


def test_depth_at_the_centre_is_that_of_the_plane_and_is_not_computed_twice(
    desk: RecordedDepthService, seen: Path
) -> None:
    found = desk.at(seen, t_s=0.0, order=DepthOrder())

    assert found.z_m == pytest.approx(Z_M, rel=2e-3)
    assert found.sigma_m is not None
    assert 0.0 < found.sigma_m < 0.05
    assert found.verged_z_m == pytest.approx(Z_M, rel=2e-3)
    assert (found.apart_ms, found.known > 0.5) == (0.0, True)
    assert desk.at(seen, t_s=0.02, order=DepthOrder()) is found


def test_both_backends_tell_the_same_depth_and_are_kept_apart(desk: RecordedDepthService, seen: Path) -> None:
    full, live = (desk.at(seen, t_s=0.0, order=DepthOrder(backend=backend)) for backend in ("sgbm", "live"))

    assert full is not live
    assert full.z_m is not None and live.z_m == pytest.approx(full.z_m, rel=1e-3)


def test_looks_of_mirrors_that_stand_still_are_fused_and_state_no_larger_error(
    desk: RecordedDepthService, seen: Path
) -> None:
    one, fused = (desk.at(seen, t_s=0.0, order=DepthOrder(looks=looks)) for looks in (1, 8))

    assert (one.looks, fused.looks) == (1, 2)  # the recording has no more
    assert one.sigma_m is not None and fused.sigma_m is not None
    assert fused.sigma_m <= one.sigma_m
    assert fused.z_m == pytest.approx(Z_M, rel=2e-3)


def test_foveae_are_laid_over_each_other_rectified_where_their_poses_are_known(seen: Path) -> None:
    with Recording(seen) as recording:
        pair = pair_at(recording, 0.0)
        rectified, plain = anaglyph(pair, observation_of(recording, pair)), anaglyph(pair, None)

    middle = rectified[200:340, 260:460].astype(np.int64)
    assert np.abs(middle[..., 0] - middle[..., 1]).mean() < 12.0  # grain of one texture lies on itself
    assert plain.shape == (1080, 1440, 3)


def test_without_calibration_or_poses_depth_is_refused_in_words(
    desk: RecordedDepthService, tmp_path: Path
) -> None:
    with pytest.raises(NotCalibrated, match="carries no calibration"):
        desk.at(look(tmp_path / "a.fcap", calibration=None), t_s=0.0, order=DepthOrder())
    with pytest.raises(InvalidInput, match="its direction is unknown"):
        desk.at(look(tmp_path / "b.fcap", volts=False), t_s=0.0, order=DepthOrder())
    record(tmp_path / "c.fcap", streams=("center",))
    with pytest.raises(InvalidInput, match="no frames of the left camera"):
        desk.at(tmp_path / "c.fcap", t_s=0.0, order=DepthOrder())


def test_frames_of_another_size_than_the_calibration_s_have_no_depth(
    desk: RecordedDepthService, tmp_path: Path
) -> None:
    rig = RigDescription(rig_id="r", name="r", baseline_m=0.2, calibration=CALIBRATION)
    record(tmp_path / "a.fcap", rig=rig)
    with pytest.raises(InvalidInput, match="32 x 24 px, its calibration is of 1440 x 1080"):
        desk.at(tmp_path / "a.fcap", t_s=0.0, order=DepthOrder())


def test_a_recording_of_others_has_outlines_by_the_matrix_that_came_with_its_frames(tmp_path: Path) -> None:
    record(tmp_path / "a.fcap")
    with Recording(tmp_path / "a.fcap") as recording:
        found = moment_document(recording, "rec-1", t_s=0.0)
        with pytest.raises(InvalidInput, match="frame 6 of left: the recording has 6"):
            frame_time_s(recording, Role.LEFT, 6)

    corner = np.array([-0.5, -0.5, 1.0]) @ np.arange(9.0).reshape(3, 3).T
    outline_px = found.frames["left"].footprint_px
    assert outline_px is not None
    assert outline_px[0] == pytest.approx(corner[:2] / corner[2], abs=0.01)
    assert found.meeting_m is None


def test_the_crossing_of_the_gazes_has_its_depth_and_its_place_in_the_wide_picture(seen: Path) -> None:
    with Recording(seen) as recording:
        found = moment_document(recording, "rec-1", t_s=0.0)

    assert found.meeting_z_m == pytest.approx(Z_M, rel=1e-3)
    np.testing.assert_allclose(
        found.meeting_px or (), CALIBRATION.wide.pixels(np.deg2rad([[2.0, -1.0]]))[0], atol=1.0
    )


class TheirSession:
    """The records of another program."""

    def __init__(self, records: dict[str, dict[str, str]]) -> None:
        self._records = records

    def records(self) -> dict[str, dict[str, str]]:
        return self._records


def theirs(path: Path) -> Path:
    """Record as the authors' application does: angles, a lens and undistorted boxes, no calibration."""
    wide = Intrinsics(
        width=32,
        height=24,
        fx_px=40.0,
        fy_px=40.0,
        cx_px=16.0,
        cy_px=12.0,
        distortion=(0.3, 0.0, 0.0, 0.0, 0.0),
    )
    rig = RigDescription(rig_id="r", name="r", baseline_m=0.2, calibration=replace(CALIBRATION, wide=wide))
    records = RecordingSession(timestamp="2026-01-31T12:00:00Z", rig=rig, app="FoveaCamApp").records()
    del records[RIG]
    with Recorder(path, TheirSession(records)) as recorder:  # type: ignore[arg-type]  # a part of one
        for tick in range(3):
            for stream, ax_rad in (("center", 0.0), ("left-fovea", 0.03), ("right-fovea", -0.01)):
                pose = FramePose(angles_rad=(ax_rad, 0.05), wide_from_fovea=np.diag([0.1, 0.1, 1.0]))
                recorder.publish(stream, replace(raw(picture("left", tick), tick=tick), pose=pose))
            if tick == 1:
                box = TrackedBox(slot="0", t_ns=BEGIN_NS + PERIOD_NS, bbox_px=(20.0, 4.0, 6.0, 6.0))
                lost = TrackedBox(slot="1", t_ns=BEGIN_NS + PERIOD_NS, bbox_px=None)
                recorder.publish_box(box)
                recorder.publish_box(lost)
    return path


def test_one_of_others_has_boxes_crossing_and_outlines_in_its_raw_picture(tmp_path: Path) -> None:
    with Recording(theirs(tmp_path / "a.fcap")) as recording:
        found = moment_document(recording, "rec-1", t_s=0.0)
        lens = read_wide_lens(recording.metadata)

    assert lens is not None
    z_m = 0.2 / (math.tan(0.03) + math.tan(0.01))
    assert found.meeting_z_m == pytest.approx(z_m, rel=1e-3)
    assert found.meeting_px == pytest.approx(lens[0].pixels([[0.01, 0.05]])[0], abs=0.1)
    (box,) = found.boxes
    assert (box.slot, box.width_px, box.late_ms) == ("0", 6.0, PERIOD_NS / 1e6)
    tangents = (np.array([[23.0, 7.0]]) - [16.0, 12.0]) / 40.0
    expected = lens[0].pixels(np.arctan(tangents))[0]
    assert (box.x_px + 3.0, box.y_px + 3.0) == pytest.approx(expected, abs=0.02)
    assert expected[0] - 23.0 > 0.05  # its lens bends
    corner = lens[0].pixels(np.arctan((np.array([[-0.05, -0.05]]) - [16.0, 12.0]) / 40.0))[0]
    assert (found.frames["left"].footprint_px or [])[0] == pytest.approx(corner, abs=0.02)


@pytest.mark.parametrize(
    ("style", "channels"),
    [
        (AnaglyphStyle.RED_CYAN, (0, 1, 1)),
        (AnaglyphStyle.CYAN_RED, (1, 0, 0)),
        (AnaglyphStyle.RED_BLUE, (0, None, 1)),
        (AnaglyphStyle.BLUE_RED, (1, None, 0)),
    ],
)
def test_each_eye_has_the_colour_of_its_glass(
    tmp_path: Path, style: AnaglyphStyle, channels: tuple[int | None, ...]
) -> None:
    record(tmp_path / "a.fcap")
    with Recording(tmp_path / "a.fcap") as recording:
        pair = pair_at(recording, 0.0)
    shown, levels = anaglyph(pair, None, style), [frame.image.mean() for frame in pair]

    for channel, eye in enumerate(channels):
        expected = 0.0 if eye is None else levels[eye]
        assert shown[:, :, channel].mean() == pytest.approx(expected, abs=0.5)


def test_the_difference_of_what_is_the_same_is_grey(seen: Path, tmp_path: Path) -> None:
    record(tmp_path / "a.fcap")
    with Recording(tmp_path / "a.fcap") as recording:
        plain = difference(pair_at(recording, 0.0), None)
    with Recording(seen) as recording:
        pair = pair_at(recording, 0.0)
        rectified = difference(pair, observation_of(recording, pair))

    assert np.unique(plain).tolist() == [128]
    middle = rectified[200:340, 260:460, 0].astype(np.int64)
    assert np.abs(middle - 128).mean() < 12.0


def test_a_centre_where_too_little_matched_has_no_depth() -> None:
    z_m = np.full((100, 100), np.nan, np.float32)
    z_m[:20] = 3.0
    ones = np.ones_like(z_m)

    assert centre_of(DepthMap(z_m=z_m, sigma_m=ones, pose_sigma_m=ones)) == (None, None)
    z_m[48:52, 48:52] = 5.0
    assert centre_of(DepthMap(z_m=z_m, sigma_m=3 * ones, pose_sigma_m=4 * ones)) == (5.0, 5.0)
