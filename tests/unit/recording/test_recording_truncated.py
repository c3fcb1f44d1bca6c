"""Recordings that were cut off or damaged: what is whole is read, what is lost is said."""

from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.recordings import STREAMS, picture, record

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.capture.recording.reader import Recording

SEED = 20_260
CUTS = 60


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("whole") / "a.fcap"
    record(path)
    return path.read_bytes()


def test_cut_off_anywhere_it_gives_every_frame_that_is_whole(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "cut.fcap"
    places = [whole.index(picture(stream, tick).tobytes()) for tick in range(6) for stream in STREAMS]
    size = picture("left", 0).size
    for cut in sorted(np.random.default_rng(SEED).integers(8, len(whole), CUTS).tolist()):
        path.write_bytes(whole[:cut])
        expected = sum(place + size <= cut for place in places)
        with Recording(path) as recording:
            frames = list(recording.frames())
            assert recording.truncation is not None, cut
            assert recording.truncation.at_byte + recording.truncation.lost_bytes <= cut
        assert len(frames) == expected, cut
        for frame in frames:
            np.testing.assert_array_equal(frame.image, picture(frame.stream, frame.seq))
            assert frame.pose.frame_id == 100 + frame.seq


def test_it_says_what_was_lost(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "cut.fcap"
    middle = whole.index(picture("center", 3).tobytes()) + 100
    path.write_bytes(whole[:middle])

    with Recording(path) as recording:
        lost = recording.truncation
        assert lost is not None
        assert lost.lost == "a message of center"
        assert 100 < lost.lost_bytes < 1000
        assert not recording.finalized


def test_a_tail_of_zeros_is_no_data(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "cut.fcap"
    path.write_bytes(whole[: len(whole) // 2] + bytes(5000))

    with Recording(path) as recording:
        assert recording.truncation is not None
        assert all(frame.pose.volts is not None for frame in recording.frames())


def test_damage_anywhere_ends_in_a_sentence_and_never_otherwise(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "damaged.fcap"
    rng, refused = np.random.default_rng(SEED), 0
    for _ in range(CUTS):
        damaged = bytearray(whole)
        for place in rng.integers(8, len(whole), 8):
            damaged[place] = int(rng.integers(0, 256))
        path.write_bytes(damaged)
        try:
            with Recording(path) as recording:
                for stream in recording.streams.values():
                    for index in range(len(stream)):
                        recording.frame(stream.name, index)
        except FoveaError as refusal:
            assert str(path) in str(refusal)
            refused += 1
    assert refused > 0
