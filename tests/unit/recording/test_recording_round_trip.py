"""What was recorded is what is read, by our reader and by the library's."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import Writer
from tests.support.scenes.recordings import BEGIN_NS, PERIOD_NS, SESSION, STREAMS, picture, pose, raw, record

from foveacam_hardware.contract import DeviceInfo, Frame, InvalidInput, MirrorVolts, Role
from foveacam_pipeline.capture.recording.pixels import pack_12p
from foveacam_pipeline.capture.recording.poses import raw_frame, wide_from_fovea
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.recorder import Recorder, RecordingOptions
from foveacam_pipeline.capture.recording.session import RigDescription, read_wide_lens
from foveacam_pipeline.capture.recording.values import RawFrame, StreamFormat, TrackedBox
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.models.footprint import fovea_corners_px, fovea_footprint_px

SHIPPED = Path("server/foveacam_server/resources/calibrating/calibrations/shipped/sim-rig120.json")


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return load_calibration(SHIPPED)


def test_every_frame_comes_back_with_its_pose(tmp_path: Path) -> None:
    counts = record(tmp_path / "a.fcap")

    with Recording(tmp_path / "a.fcap") as recording:
        assert (recording.truncation, recording.finalized) == (None, True)
        for stream in STREAMS:
            assert counts[stream].written == len(recording.stream(stream)) == 6
            for tick in range(6):
                frame, told = recording.frame(stream, tick), pose(tick)
                np.testing.assert_array_equal(frame.image, picture(stream, tick))
                assert (frame.seq, frame.t_ns) == (tick, BEGIN_NS + tick * PERIOD_NS)
                assert (frame.pose.frame_id, frame.pose.volts) == (told.frame_id, told.volts)
                assert (frame.pose.angles_rad, frame.pose.exposure_ns) == (told.angles_rad, 4_000_000)
                assert frame.pose.wide_from_fovea is not None
                np.testing.assert_array_equal(frame.pose.wide_from_fovea, np.arange(9).reshape(3, 3) + tick)


def test_frames_are_found_by_time_and_stream(tmp_path: Path) -> None:
    record(tmp_path / "a.fcap")

    with Recording(tmp_path / "a.fcap") as recording:
        found = recording.frames(
            ["left", "right"], start_ns=BEGIN_NS + PERIOD_NS, end_ns=BEGIN_NS + 3 * PERIOD_NS
        )
        assert [(frame.seq, frame.stream) for frame in found] == [
            (1, "left"),
            (1, "right"),
            (2, "left"),
            (2, "right"),
        ]
        assert recording.nearest("left", BEGIN_NS + round(2.4 * PERIOD_NS)).seq == 2
        assert recording.span_ns == (BEGIN_NS, BEGIN_NS + 5 * PERIOD_NS)
        assert recording.stream("left").fps == pytest.approx(50.0)
        assert recording.stream_of_role(Role.WIDE) is recording.stream("center")


def test_frames_outlive_their_recording(tmp_path: Path) -> None:
    record(tmp_path / "a.fcap")
    with Recording(tmp_path / "a.fcap") as recording:
        kept = recording.frame("left", -1)

    np.testing.assert_array_equal(kept.image, picture("left", 5))


@pytest.mark.parametrize("packed", [True, False])
@pytest.mark.parametrize("compress", [True, False])
def test_twelve_bits_come_back_packed_or_not_compressed_or_not(
    tmp_path: Path, packed: bool, compress: bool
) -> None:
    deep = np.random.default_rng(2).integers(0, 4096, (5, 7), dtype=np.uint16)
    with Recorder(tmp_path / "a.fcap", SESSION, options=RecordingOptions(compress=compress)) as recorder:
        recorder.publish("left", raw(deep, tick=0, bits=12, packed=packed))

    with Recording(tmp_path / "a.fcap") as recording:
        form = recording.stream("left").form
        assert (form.packed, form.compressed, form.bits) == (packed, compress, 12)
        np.testing.assert_array_equal(recording.frame("left", 0).image, deep)


def test_packed_bytes_of_a_camera_are_kept_as_they_came(tmp_path: Path) -> None:
    mosaic = np.zeros((4, 6), dtype=np.uint16)
    mosaic[::2, ::2] = 3000
    sent = pack_12p(mosaic)
    form = StreamFormat(pixel_format="BayerRG12p", dtype="U8", height=4, width=6, channels=1, bits=12)
    with Recorder(tmp_path / "a.fcap", SESSION) as recorder:
        recorder.publish("left", RawFrame(payload=sent, form=form, seq=0, t_ns=1))

    assert sent.tobytes() in (tmp_path / "a.fcap").read_bytes()
    with Recording(tmp_path / "a.fcap") as recording:
        frame = recording.frame("left", 0)
        assert frame.image[1, 2].tolist() == [3000, 0, 0]
        np.testing.assert_array_equal(frame.raw, mosaic)
        assert pack_12p(frame.raw).tobytes() == sent.tobytes()


@pytest.mark.parametrize(("height", "width"), [(2, 2), (5, 7), (24, 32)])
@pytest.mark.parametrize("compress", [True, False])
def test_a_mosaic_comes_back_bit_for_bit_beside_its_picture(
    tmp_path: Path, height: int, width: int, compress: bool
) -> None:
    mosaic = np.random.default_rng(3).integers(1, 256, (height, width), dtype=np.uint8)
    form = StreamFormat(pixel_format="BayerGB8", dtype="U8", height=height, width=width, channels=1, bits=8)
    with Recorder(tmp_path / "a.fcap", SESSION, options=RecordingOptions(compress=compress)) as recorder:
        recorder.publish("left", RawFrame(payload=mosaic, form=form, seq=0, t_ns=1))

    with Recording(tmp_path / "a.fcap") as recording:
        frame = recording.frame("left", 0)
    assert frame.raw.tobytes() == mosaic.tobytes()
    assert frame.image.shape == (height, width, 3)
    assert frame.image.min() > 0  # right to the border


def test_the_number_of_an_exposure_goes_with_its_volts(tmp_path: Path) -> None:
    seen = Frame(image=picture("left", 0), role=Role.LEFT, seq=3, t_ns=BEGIN_NS, exposure_ns=1_000_000)
    drive = MirrorVolts(x_v=1.5, y_v=-2.0)
    with Recorder(tmp_path / "a.fcap", SESSION) as recorder:
        recorder.publish("left", raw_frame(seen.with_volts(drive, frame_id=41)))
        recorder.publish("center", raw_frame(replace(seen, role=Role.WIDE)))

    with Recording(tmp_path / "a.fcap") as recording:
        assert (recording.pose("left", 0).frame_id, recording.pose("left", 0).volts) == (41, drive)
        assert recording.pose("center", 0).frame_id is None


def test_the_library_reads_it_and_finds_telemetry_before_its_frame(tmp_path: Path) -> None:
    record(tmp_path / "a.fcap", ticks=2)
    with (tmp_path / "a.fcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        header, summary = reader.get_header(), reader.get_summary()
        topics = [channel.topic for _, channel, _ in reader.iter_messages(log_time_order=False)]
        names = [record.name for record in reader.iter_metadata()]
    with (tmp_path / "a.fcap").open("rb") as file:
        straight = sum(1 for _ in NonSeekingReader(file, validate_crcs=True).iter_messages())

    assert header.profile == "fovea"
    assert summary is not None and summary.statistics is not None
    assert summary.statistics.message_count == straight == len(topics) == 12
    assert summary.statistics.chunk_count == 6
    assert topics == [topic for stream in STREAMS for topic in ("telemetry", stream)] * 2
    assert names == ["fovea:session", "foveacam:statistics", "fovea:finalize"]
    assert {schema.name: schema.encoding for schema in summary.schemas.values()} == {
        "fovea.raw_frame/v1": "jsonschema",
        "fovea.frame_meta/v1": "jsonschema",
        "fovea.descriptor/v1": "jsonschema",
    }


def test_tracked_boxes_come_back(tmp_path: Path) -> None:
    given = TrackedBox(slot="target 1", t_ns=BEGIN_NS, bbox_px=(1.0, 2.0, 30.0, 40.0), frames={"center": 3})
    with Recorder(tmp_path / "a.fcap", SESSION) as recorder:
        recorder.publish_box(given)
        recorder.publish("center", raw(picture("center", 0), tick=0))
        recorder.publish_box(TrackedBox(slot="lost", t_ns=BEGIN_NS + 1, bbox_px=None))

    with Recording(tmp_path / "a.fcap") as recording:
        assert recording.slots == ("lost", "target 1")
        assert len(recording.stream("center")) == 1
    with (tmp_path / "a.fcap").open("rb") as file:
        found = {
            channel.topic: (message.log_time, json.loads(message.data))
            for _, channel, message in make_reader(file).iter_messages(["fovea/target 1", "fovea/lost"])
        }
    box = {"x": 1.0, "y": 2.0, "width": 30.0, "height": 40.0}
    assert found == {
        "fovea/target 1": (BEGIN_NS, {"tNs": BEGIN_NS, "bbox": box, "frames": {"center": 3}}),
        "fovea/lost": (BEGIN_NS + 1, {"tNs": BEGIN_NS + 1, "bbox": None, "frames": {}}),
    }


def test_the_rig_comes_back_with_its_calibration(tmp_path: Path, calibration: Calibration) -> None:
    who = DeviceInfo(vendor="v", model="m", serial="42")
    rig = RigDescription(
        rig_id=calibration.rig_id,
        name="A rig",
        baseline_m=0.2,
        cameras={"left": who},
        calibration=calibration,
    )
    record(tmp_path / "a.fcap", ticks=1, rig=rig)

    with Recording(tmp_path / "a.fcap") as recording:
        found, lens = recording.rig, read_wide_lens(recording.metadata)
        assert found is not None and found.calibration is not None and lens is not None
        assert (found.calibration.id, found.problem) == (calibration.id, None)
        assert (found.rig_id, found.cameras["left"].serial) == (calibration.rig_id, "42")
        assert lens[0] == calibration.wide
        assert lens[1] == pytest.approx(calibration.baseline_m)


def test_the_affine_lays_the_fovea_where_its_footprint_is(calibration: Calibration) -> None:
    volts = calibration.steer(0.1, -0.05).left
    gaze = calibration.left.mirror.angles_rad(volts)
    matrix = wide_from_fovea(calibration, Role.LEFT, angles_rad=gaze)
    undistorted = homography_apply(matrix, fovea_corners_px(calibration))
    angles = np.arctan(
        (undistorted - [calibration.wide.cx_px, calibration.wide.cy_px])
        / [calibration.wide.fx_px, calibration.wide.fy_px]
    )

    np.testing.assert_allclose(
        calibration.wide.pixels(angles), fovea_footprint_px(calibration, Role.LEFT, volts), atol=1e-6
    )


def test_a_recording_never_takes_the_place_of_a_file(tmp_path: Path) -> None:
    record(tmp_path / "a.fcap", ticks=1)

    with pytest.raises(InvalidInput, match="there is such a file already"):
        record(tmp_path / "a.fcap", ticks=1)
    with pytest.raises(InvalidInput, match="no folder"):
        record(tmp_path / "none" / "a.fcap")


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n", b"something else entirely"])
def test_what_is_no_recording_is_refused_or_empty(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.fcap"
    path.write_bytes(content)
    if content.startswith(b"\x89MCAP0"):
        with Recording(path) as recording:
            assert recording.streams == {} and recording.truncation is not None
        return
    with pytest.raises(InvalidInput, match=r"a\.fcap"):
        Recording(path)


def test_an_mcap_file_of_other_programs_is_refused_with_its_topics(tmp_path: Path) -> None:
    path = tmp_path / "robot.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema_id = writer.register_schema(name="std_msgs/String", encoding="jsonschema", data=b"{}")
        channel_id = writer.register_channel(schema_id=schema_id, topic="/chatter", message_encoding="json")
        writer.add_message(channel_id=channel_id, log_time=5, data=b"{}", publish_time=5)
        writer.finish()  # type: ignore[no-untyped-call]  # the library states no types
    with pytest.raises(InvalidInput, match=r"robot\.mcap: an MCAP file without a stream") as refused:
        Recording(path)
    assert refused.value.found == "topics of other programs: /chatter"


def test_a_stream_and_a_frame_that_there_are_not_are_named(tmp_path: Path) -> None:
    record(tmp_path / "a.fcap", ticks=2)
    with Recording(tmp_path / "a.fcap") as recording:
        with pytest.raises(InvalidInput, match="'top'; there are left, center, right"):
            recording.frame("top", 0)
        with pytest.raises(InvalidInput, match="frame 2 of left is not one of its 2"):
            recording.frame("left", 2)
