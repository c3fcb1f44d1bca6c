"""`foveacam capture`: what is refused is refused in one line, before a device is opened."""

from pathlib import Path
from typing import NoReturn

import pytest
from tests.support.scenes.dataset_scenes import header, noise_point, written

from foveacam_pipeline.capture.dataset import DatasetWriter
from foveacam_server import cli


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
