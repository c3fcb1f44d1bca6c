"""Films of recordings."""

from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.recordings import picture, record

from foveacam_hardware.contract import DeviceFault, InvalidInput, StorageFull
from foveacam_pipeline.capture.recording.formats import (
    ENCODERS,
    FORMATS,
    Encoder,
    MovieCodec,
    check_format,
    format_named,
)
from foveacam_pipeline.capture.recording.movie import MovieSpec, export_movie, suffix_of
from foveacam_pipeline.capture.recording.reader import Recording

QUICK = MovieCodec.MPEG4


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("movie") / "a.fcap"
    record(path)
    return path


def frames_of(film: Path) -> list[NDArray[np.uint8]]:
    """Return the pictures of a film, by OpenCV; by PyAV those that OpenCV has no decoder for."""
    reader, found = cv2.VideoCapture(str(film)), []
    while (read := reader.read())[0]:
        found.append(np.asarray(read[1], dtype=np.uint8)[:, :, ::-1])
    reader.release()
    if found:
        return found
    with av.open(str(film)) as container:
        return [
            np.asarray(frame.to_ndarray(format="rgb24"), dtype=np.uint8)
            for frame in container.decode(video=0)
        ]


def test_a_stream_becomes_a_film_at_the_recorded_rate(recording: Path, tmp_path: Path) -> None:
    with Recording(recording) as opened:
        made = export_movie(opened, MovieSpec(show="center", codec=QUICK), tmp_path / "a.mp4")
    shown = frames_of(tmp_path / "a.mp4")

    assert (made.frames, made.width, made.height) == (6, 32, 24)
    assert made.fps == pytest.approx(50.0)
    assert len(shown) == 6
    for tick, frame in enumerate(shown):
        assert np.abs(frame[:, :, 0].astype(int) - picture("center", tick)).mean() < 6.0
    np.testing.assert_allclose(np.diff([frame.mean() for frame in shown]), 3.0, atol=1.5)


def test_resampled_it_shows_the_nearest_frame_of_every_moment(recording: Path, tmp_path: Path) -> None:
    with Recording(recording) as opened:
        made = export_movie(opened, MovieSpec(show="left", fps=100.0, codec=QUICK), tmp_path / "a.mp4")

    assert (made.frames, made.fps) == (11, 100.0)


def test_a_part_is_cut_out_by_its_seconds(recording: Path, tmp_path: Path) -> None:
    with Recording(recording) as opened:
        wish = MovieSpec(show="left", codec=QUICK, start_s=0.02, end_s=0.06)
        assert export_movie(opened, wish, tmp_path / "a.mp4").frames == 2


def test_both_eyes_stand_side_by_side_or_in_red_and_cyan(recording: Path, tmp_path: Path) -> None:
    with Recording(recording) as opened:
        beside = export_movie(opened, MovieSpec(show="side-by-side", codec=QUICK), tmp_path / "a.mp4")
        export_movie(opened, MovieSpec(show="anaglyph", codec=QUICK), tmp_path / "b.mp4")
    level = frames_of(tmp_path / "b.mp4")[0].mean(axis=(0, 1))

    assert (beside.width, beside.height) == (64, 24)
    assert level[0] == pytest.approx(picture("left", 0).mean(), abs=4.0)
    assert level[1] == pytest.approx(picture("right", 0).mean(), abs=4.0)


def test_what_cannot_be_shown_is_refused_and_leaves_nothing(recording: Path, tmp_path: Path) -> None:
    refused = [
        (MovieSpec(show="top"), "a.mp4", "no stream 'top'"),
        (MovieSpec(show="left"), "a.avi", "end it in .mp4"),
        (MovieSpec(show="left", start_s=9.0), "a.mp4", "has no frame from 9.000 s to its end"),
        (MovieSpec(show="left", start_s=1.0, end_s=0.5), "a.mp4", "give a later end"),
        (MovieSpec(show="left", fps=1e9), "a.mp4", "give another rate"),
        (MovieSpec(show="left"), "none/a.mp4", "no folder"),
    ]
    with Recording(recording) as opened:
        for wish, name, why in refused:
            with pytest.raises(InvalidInput, match=why):
                export_movie(opened, wish, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("codec", MovieCodec)
def test_every_codec_keeps_the_colours(recording: Path, tmp_path: Path, codec: MovieCodec) -> None:
    with Recording(recording) as opened:
        film = tmp_path / f"a{suffix_of(codec)}"
        made = export_movie(opened, MovieSpec(show="anaglyph", codec=codec), film)
    shown = frames_of(film)

    assert (made.codec, len(shown)) == (codec, 6)
    for role, channel in (("left", 0), ("right", 1), ("right", 2)):
        assert shown[3][:, :, channel].mean() == pytest.approx(picture(role, 3).mean(), abs=4.0)


def test_without_an_encoder_it_says_so(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(ENCODERS, MovieCodec.H264, Encoder(name="none_such"))
    with Recording(recording) as opened, pytest.raises(DeviceFault, match="cannot be encoded as avc1"):
        export_movie(opened, MovieSpec(show="left"), tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_told_and_leaves_nothing(recording: Path, tmp_path: Path) -> None:
    (tmp_path / ".a.part.mp4").symlink_to("/dev/full")
    with Recording(recording) as opened, pytest.raises(StorageFull, match="the disk is full"):
        export_movie(opened, MovieSpec(show="left"), tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_film_is_taken_away(recording: Path, tmp_path: Path) -> None:
    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with Recording(recording) as opened, pytest.raises(KeyboardInterrupt):
        export_movie(opened, MovieSpec(show="left", codec=QUICK), tmp_path / "a.mp4", progress=interrupt)
    assert list(tmp_path.iterdir()) == []


def test_a_format_without_its_encoder_is_refused_with_those_that_there_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(ENCODERS, MovieCodec.AV1, Encoder(name="none_such"))
    with pytest.raises(InvalidInput, match="no encoder none_such on this machine; choose another: H"):
        check_format(format_named("av1"))
    check_format(format_named("avc1"))
    assert [found.name for found in FORMATS.values() if found.missing] == ["av1"]
