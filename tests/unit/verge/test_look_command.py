"""`foveacam look`: what is refused before a device is opened, and an answer in words and as a file."""

from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest
from tests.support.scenes.fixations import fixation

from foveacam_hardware.contract import FoveaError
from foveacam_server import cli
from foveacam_server.resources.looking.fixations.answer_words import answer_lines
from foveacam_server.resources.looking.fixations.cli_order import LookOrder, print_answer, save_shape
from foveacam_server.resources.looking.fixations.schema import (
    AlternativeDocument,
    BoundDocument,
    EyeViewDocument,
    FixationDocument,
)

SEEN, HIDDEN = EyeViewDocument(sees_target=True, reason=""), EyeViewDocument(sees_target=False, reason="no")


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    def opened(*_: object, **__: object) -> NoReturn:
        raise AssertionError("no device is to be opened")

    monkeypatch.setattr("foveacam_server.resources.looking.fixations.cli_run.open_enabled_rig", opened)
    monkeypatch.setenv("FOVEACAM_DATA", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def answer(**more: object) -> FixationDocument:
    return fixation("one").model_copy(update={"basis": "both_foveae", **more})


@pytest.mark.parametrize(
    ("words", "status", "message"),
    [
        (("720", "540", "--save", "cloud.xyz"), 2, "written as .ply (points), .glb"),
        (("720", "540", "--save", "cloud"), 2, "end the name in one of these"),
        (("720", "540", "--save", "no/cloud.ply"), 2, "there is no folder no; make it"),
        (("1500", "540"), 1, "1500"),
        (("nan", "540"), 2, "x_px is not a number; needed is a finite number"),
        (("720", "left"), 2, "Invalid value for 'Y'"),
        (("720", "540", "--server", "here"), 2, "it names no host"),
        (("720", "540", "--server", "http://127.0.0.1:1"), 1, "start it, or leave --server out"),
    ],
)
def test_what_cannot_be_looked_at_is_refused_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    status: int,
    message: str,
) -> None:
    monkeypatch.setattr("sys.argv", ["foveacam", "look", *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == status
    captured = capsys.readouterr()
    assert (captured.out, captured.err.count("\n")) == ("", 1)
    assert captured.err.startswith("foveacam: ")
    assert message in captured.err


@pytest.mark.parametrize(
    ("found", "lines"),
    [
        (
            answer(),
            ["2.000 ± 0.010 m", "Measured by both foveae: left against right, confirmed by the wide view."],
        ),
        (
            answer(basis="fovea_and_wide", left_view=SEEN, right_view=HIDDEN),
            [
                "2.000 ± 0.010 m",
                "Measured by the left fovea and the wide camera: the other eye does not see it. Half the"
                " baseline: a larger ±.",
            ],
        ),
        (
            answer(
                basis="bound",
                distance_m=None,
                distance_sigma_m=None,
                bound=BoundDocument(nearest_m=3.04, farthest_m=None),
            ),
            ["farther than 3.0 m", "Limits only: the distance itself could not be measured."],
        ),
    ],
)
def test_an_answer_is_its_distance_and_a_sentence_on_its_basis(
    found: FixationDocument, lines: list[str]
) -> None:
    assert answer_lines(found) == lines


def test_every_alternative_is_listed_with_its_probability() -> None:
    others = [
        AlternativeDocument(
            basis="surroundings",
            distance_m=distance_m,
            distance_sigma_m=0.2,
            point_rig_m=(0.0, 0.0, distance_m),
            probability=probability,
        )
        for distance_m, probability in ((2.0, 0.7), (4.5, 0.3))
    ]
    lines = answer_lines(answer(basis="surroundings", alternatives=others))
    assert lines[1].startswith("Inferred from its surroundings: nothing on it can be matched")
    assert lines[2:] == [
        "It may be at one of these distances:",
        "  2.00 ± 0.20 m from its surroundings, probability 70 %",
        "  4.50 ± 0.20 m from its surroundings, probability 30 %",
    ]


def test_a_look_without_a_distance_is_an_error_that_says_why() -> None:
    order = LookOrder.checked(700.0, 500.0, save=None)
    lost = answer(basis=None, state="lost", reason="the target left the view; look again")
    with pytest.raises(FoveaError, match=r"look at \(700, 500\): no distance was found \(lost\): the target"):
        print_answer(order, lost, as_json=False)


@pytest.mark.parametrize(
    ("basis", "state"),
    [("fovea_and_wide", "lost"), ("bound", "no_texture"), ("surroundings", "out_of_range")],
)
def test_an_answer_without_a_shape_writes_no_file(data: Path, basis: str, state: str) -> None:
    order = LookOrder.checked(700.0, 500.0, save=data / "cloud.ply")
    content: Callable[[], bytes] = pytest.fail
    with pytest.raises(FoveaError, match=r"not both foveae show the place \(700, 500\), so it has no shape"):
        save_shape(order, answer(basis=basis, state=state), content, as_json=False)
    assert not (data / "cloud.ply").exists()


def test_the_shape_is_written_whole_and_named(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    order = LookOrder.checked(700.0, 500.0, save=Path("cloud.PLY"))
    save_shape(order, answer(), lambda: b"ply\n" * 50_000, as_json=False)
    assert (data / "cloud.PLY").read_bytes() == b"ply\n" * 50_000
    assert capsys.readouterr().out == "cloud.PLY: 0.2 MB\n"
