"""`foveacam capture`: what is refused is refused in one line, before a device is opened."""

from pathlib import Path
from typing import NoReturn

import pytest
from tests.support.scenes.dataset_scenes import header, noise_point, written

from foveacam_pipeline.capture.dataset import DatasetWriter
from foveacam_server import cli
from foveacam_server.resources.capturing.captures.cli_order import estimate_words, span_words
from foveacam_server.resources.capturing.captures.schema import CoverageDocument, EstimateDocument


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    def opened(*_: object, **__: object) -> NoReturn:
        raise AssertionError("no device is to be opened")

    monkeypatch.setattr("foveacam_server.resources.capturing.captures.cli_run.open_enabled_rig", opened)
    monkeypatch.setenv("FOVEACAM_DATA", str(tmp_path))
    return tmp_path


def refusal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Run `foveacam capture`, which is to end with status 2 or 1; return its one line."""
    monkeypatch.setattr("sys.argv", ["foveacam", "capture", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code in (1, 2)
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith("foveacam: ")
    return lines[0]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--name", "../up"], "begins with a dot"),
        (["--name", "/etc"], "separates folders"),
        (["--name", "x" * 300], "300 characters"),
        (["--name", "a\u202eb"], "U+202E"),
        (["--name", "a\u200bb"], "U+200B"),
        (["--name", "COM1"], "Windows keeps that name"),
        (["--name", "dot."], "ends with a dot"),
        (["--name", "ONE"], "already"),
        (["--name", "a", "--columns", "0"], "columns"),
        (["--name", "a", "--codec", "jpeg"], "tiff or png"),
        (["--name", "none", "--resume"], "there is no capture 'none'"),
        (["--name", "one", "--resume"], "it is complete"),
        (["--name", "newer", "--resume"], "use a newer version of this program"),
        (["--name", "one", "--watch"], "--watch: it is about a server's capture; name the server"),
        (["--name", "one", "--resume", "--cancel"], "--resume and --cancel: one at a time"),
        ([], "it has no name; give one with --name"),
        (["--resume"], "it has no name"),
        (["--estimate", "--resume"], "--resume and --estimate: one at a time"),
        (["--name", "a", "--server", "here"], "'here' is no address of a server: it names no host"),
        (["--name", "a", "--server", "http://127.0.0.1:1"], "start it, or leave --server out"),
    ],
)
def test_what_cannot_be_captured_is_refused_in_one_line(
    data: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    message: str,
) -> None:
    written(data / "captures" / "one", 1)
    newer = written(data / "captures" / "newer", 1).folder / "dataset.json"
    newer.write_text(newer.read_text().replace('"version": 1', '"version": 2'))

    assert message in refusal(monkeypatch, capsys, *words)


def test_a_partial_capture_is_found_by_its_name_however_its_accents_are_written(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with DatasetWriter.create(data / "captures" / "été", header(2)) as writer:
        writer.add(noise_point(0))
        writer.close("cancelled")
    monkeypatch.setattr("sys.argv", ["foveacam", "capture", "--resume", "--name", "e\u0301te\u0301"])
    with pytest.raises(AssertionError, match="no device is to be opened"):
        cli.app(standalone_mode=False, args=["capture", "--resume", "--name", "e\u0301te\u0301"])


@pytest.mark.parametrize(
    ("low_s", "high_s", "words"),
    [
        (12.4, 24.2, "12 to 25 s"),
        (2.71, 5.02, "2.7 to 5.1 s"),
        (30.0, 95.0, "0.5 to 1.6 min"),
        (700.0, 1300.0, "11 to 22 min"),
        (3600.0, 7200.0, "1.0 to 2.0 h"),
        (12.0, 12.0, "12 s"),
        (0.3, 0.6, "0.3 to 0.6 s"),
        (0.24, 11.6, "0.2 to 12 s"),
    ],
)
def test_a_range_of_time_has_the_unit_that_suits_it_and_is_rounded_outwards(
    low_s: float, high_s: float, words: str
) -> None:
    assert span_words(low_s, high_s) == words


def estimate(**more: object) -> EstimateDocument:
    found = EstimateDocument(
        plan={},
        distance_assumed=False,
        points=81,
        shots=81,
        total_s=2.7,
        duration_low_s=25.0,
        duration_high_s=48.0,
        preparing_low_s=8.0,
        preparing_high_s=14.0,
        preparing_fixations=9,
        timed_captures=3,
        limit_s=2.7,
        reverge_s=0.0,
        rail_s=0.0,
        hand_moves=0,
        files=243,
        raw_bytes=378_000_000,
        stored_bytes=378_000_000,
        free_bytes=51_000_000_000,
        kinds=[],
        warnings=[],
        coverage=CoverageDocument(
            footprints=[],
            seen_either=1.0,
            seen_both=1.0,
            overlap_across=None,
            overlap_down=None,
            outside_wide=0,
        ),
    )
    return found.model_copy(update=more)


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (
            estimate(),
            "81 points, 243 images: 25 to 48 s, 378 MB of 51000 MB free; 8 to 14 s of it to measure the"
            " scene's distance by 9 fixations, by the times of this rig's last 3 captures",
        ),
        (
            estimate(preparing_fixations=0, timed_captures=0, hand_moves=5),
            "81 points, 243 images: 25 to 48 s, 378 MB of 51000 MB free; without 5 moves by hand, assumed"
            " until a capture of this rig was timed",
        ),
        (
            estimate(preparing_fixations=0, timed_captures=1),
            "81 points, 243 images: 25 to 48 s, 378 MB of 51000 MB free; by the times of this rig's last"
            " capture",
        ),
    ],
)
def test_an_estimate_is_a_range_that_says_what_it_is_from(found: EstimateDocument, words: str) -> None:
    assert estimate_words(found) == words
