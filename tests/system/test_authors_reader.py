"""The authors' own reader over our recordings, where FOVEACAM_PYFCAP names a clone's folder `pyfcap`."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.support.scenes.recordings import STREAMS, picture, pose, record

READER = os.environ.get("FOVEACAM_PYFCAP")

pytestmark = pytest.mark.skipif(READER is None, reason="FOVEACAM_PYFCAP names no clone of theirs")


def test_their_reader_finds_our_pixels_and_poses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [str(Path(READER or "") / "src"), *sys.path])
    fovea = pytest.importorskip("fcap.fovea")
    record(tmp_path / "a.fcap")
    with fovea.FoveaReader(tmp_path / "a.fcap") as reader:
        frames = list(reader.iter_frames_streaming())

    assert len(frames) == 6 * len(STREAMS)
    for frame in frames:
        tick = frame.frame_id - 100
        told = pose(tick).volts
        assert told is not None
        np.testing.assert_array_equal(frame.raw, picture(frame.stream.name, tick))
        assert (frame.volt.x, frame.volt.y, frame.volt_source) == (told.x_v, told.y_v, "fin-averaged")
        np.testing.assert_array_equal(frame.affine, np.arange(9.0).reshape(3, 3) + tick)
