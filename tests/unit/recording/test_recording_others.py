"""Files as other programs write them, by the library's own writer: the authors' order, suffix and units."""

import io
import json
import zlib
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from tests.support.scenes.recordings import picture

from foveacam_pipeline.capture.recording.reader import Recording

METADATA = {
    "dtype": "U8",
    "shape": "[24, 32]",
    "width": "32",
    "height": "24",
    "channels": "1",
    "pixelFormat": "Mono8",
    "significantBits": "8",
    "stride": "32",
}


def written(
    *,
    compression: CompressionType = CompressionType.NONE,
    chunk_size: int = 262_144,
    pixels_by_zlib: bool = False,
    chunked: bool = True,
    ticks: int = 10,
) -> bytes:
    """Return a file with telemetry after its frames, all of it behind the last one."""
    out = io.BytesIO()
    writer = Writer(out, compression=compression, chunk_size=chunk_size, use_chunking=chunked)
    writer.start("fovea", "FoveaCamApp")
    raw = writer.register_schema("fovea.raw_frame/v1", "jsonschema", b"{}")
    suffix = "/zlib" if pixels_by_zlib else ""
    metadata = METADATA | {"pixelFormat": "Mono8" + suffix}
    frames = writer.register_channel("left-fovea", "x-fovea-raw", raw, metadata)
    telemetry = writer.register_channel("telemetry", "json", 0)
    for tick in range(ticks):
        pixels = picture("left", tick).tobytes()
        writer.add_message(
            frames, 1000 + tick, zlib.compress(pixels) if pixels_by_zlib else pixels, 1000 + tick, tick
        )
    for tick in range(ticks):
        told = {"stream": "left-fovea", "seq": tick, "t": 0.1, "volt": {"x": float(tick), "y": 2}}
        writer.add_message(telemetry, 1000 + tick, json.dumps(told).encode(), 1000 + tick)
    writer.add_metadata("fovea:finalize", {"durationSec": "1"})
    writer.finish()  # type: ignore[no-untyped-call]  # the library leaves out what it returns
    return out.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        written(),
        written(chunk_size=2000),
        written(pixels_by_zlib=True),
        written(compression=CompressionType.ZSTD, chunk_size=3000),
        written(chunked=False),
    ],
    ids=["one chunk", "small chunks", "zlib", "zstd", "no chunks"],
)
def test_frames_are_joined_with_telemetry_that_follows_them(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "older.fovea"
    path.write_bytes(content)

    with Recording(path) as recording:
        frames = list(recording.frames())
        assert [frame.seq for frame in frames] == list(range(10))
        for frame in frames:
            np.testing.assert_array_equal(frame.image, picture("left", frame.seq))
            assert frame.pose.volts is not None
            assert (frame.pose.volts.x_v, frame.pose.volts.y_v) == (frame.seq, 2.0)


def test_a_big_chunk_that_is_cut_off_still_gives_its_whole_frames(tmp_path: Path) -> None:
    content = written()
    path = tmp_path / "cut.fcap"
    path.write_bytes(content[: content.index(picture("left", 7).tobytes()) + 10])

    with Recording(path) as recording:
        assert [frame.seq for frame in recording.frames()] == list(range(7))
        assert recording.truncation is not None
        assert recording.truncation.lost == "a message of left-fovea"


def test_telemetry_that_makes_no_sense_is_nothing_known(tmp_path: Path) -> None:
    out = io.BytesIO()
    writer = Writer(out, compression=CompressionType.NONE)
    writer.start("fovea", "x")
    frames = writer.register_channel("left", "x-fovea-raw", 0, METADATA)
    telemetry = writer.register_channel("telemetry", "json", 0)
    nonsense = [b"{", b"[1]", b'{"stream": "left", "seq": 0, "volt": 3, "affine": [1], "angle": {"x": "a"}}']
    for number, message in enumerate(nonsense):
        writer.add_message(telemetry, number, message, number)
    writer.add_message(frames, 3, picture("left", 0).tobytes(), 3, 0)
    writer.finish()  # type: ignore[no-untyped-call]  # the library leaves out what it returns
    (tmp_path / "a.fcap").write_bytes(out.getvalue())

    with Recording(tmp_path / "a.fcap") as recording:
        told = recording.frame("left", 0).pose
        assert (told.volts, told.angles_rad, told.wide_from_fovea) == (None, None, None)
