"""`foveacam board`: the PDF that it writes, and what it refuses in one line."""

import json
from pathlib import Path

import pytest
from tests.support.pages.printed_pages import PX_PER_MM, printed_pages

import foveacam_hardware
from foveacam_pipeline.calibrate.wide.board_detector import detect_board
from foveacam_pipeline.calibrate.wide.boards import Charuco
from foveacam_server import cli

EXAMPLES = Path(foveacam_hardware.__file__).parent / "examples"


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str | Path) -> int:
    """Run `foveacam board` and return its exit status."""
    monkeypatch.setattr("sys.argv", ["foveacam", "board", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert isinstance(ended.value.code, int)
    return ended.value.code


def test_a_charuco_board_is_written_at_its_true_size(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "new" / "board.pdf"
    assert run(monkeypatch, "charuco", "--squares", "7x5", "--marker-mm", "22", "-o", file) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "(7 x 5 squares), markers 0 to 16 of 4X4_50, side 22 mm; 1 sheet of A4, landscape" in told
    (page,) = printed_pages(file.read_bytes())
    board = Charuco(columns=6, rows=4, square_m=0.030, marker_m=0.022)
    found = detect_board(page.image(), board)
    assert found is not None
    assert len(found.corners_px) == board.corners
    span_mm = (found.corners_px[-1] - found.corners_px[0]) / PX_PER_MM
    assert span_mm == pytest.approx([150.0, 90.0], abs=0.1)


@pytest.mark.parametrize(
    ("arguments", "description"),
    [
        (["checkerboard"], "checkerboard of 9 x 6 inner corners, squares of 25 mm (10 x 7 squares)"),
        (["markers"], "markers 1, 0, 2 of 4X4_50, side 60 mm, 100 mm apart"),
        (["markers", "--spacing-mm", "80"], "markers 1, 0, 2 of 4X4_50, side 60 mm, 80 mm apart"),
        (["marker", "--id", "7"], "marker 7 of 4X4_50, side 60 mm"),
        (
            ["charuco", "--squares", "5x6", "--dictionary", "5X5_50"],
            "ChArUco board of 4 x 5 inner corners, squares of 30 mm (5 x 6 squares), "
            "markers 0 to 14 of 5X5_50, side 22.5 mm",
        ),
    ],
)
def test_json_says_what_was_written(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    arguments: list[str],
    description: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, *arguments, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["description"] == description
    assert found["file"] == f"{arguments[0]}.pdf"
    (page,) = printed_pages((tmp_path / found["file"]).read_bytes())
    assert page.words[1] == f"{description}; print at 100 %"


def test_the_markers_are_spaced_by_the_baseline_of_a_rig_file(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    rig = tmp_path / "rig.toml"
    example = (EXAMPLES / "serial.toml").read_text(encoding="utf-8")
    rig.write_text(example.replace("baseline_m = 0.2 ", "baseline_m = 0.25 "), encoding="utf-8")
    assert run(monkeypatch, "markers", "--rig", rig, "--paper", "A3", "-o", tmp_path / "m.pdf", "--json") == 0
    assert "side 60 mm, 125 mm apart" in json.loads(capsys.readouterr().out)["description"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["charuco", "--squares", "12x12"], "needs 72 markers, dictionary 4X4_50 has 50; take a smaller"),
        (["charuco", "--marker-mm", "40"], "give a smaller marker"),
        (["charuco", "--dictionary", "7X7"], "needed is one of '4X4_50'"),
        (["checkerboard", "--squares", "7"], "two whole numbers are needed, such as 7x5"),
        (["checkerboard", "--squares", "3x9"], "at least 4x4 squares are needed"),
        (["checkerboard", "--square-mm", "200"], "at most 9 are printed; choose smaller squares"),
        (["markers", "--paper", "B5"], "'A4', 'A3' or 'Letter'"),
        (["marker", "--id", "50"], "at most 49"),
    ],
)
def test_what_cannot_be_printed_is_refused_in_one_line_and_nothing_is_written(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    arguments: list[str],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, *arguments) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert words in line
    assert list(tmp_path.iterdir()) == []
