"""An error's text is its statement and its remedy; no statement in the source contains its remedy."""

import ast
import pickle
from pathlib import Path

import pytest

from foveacam_hardware.contract import Busy, FoveaError

ROOT = Path(__file__).parents[3]
PRODUCT = [path for top in ("hardware", "pipeline", "server") for path in sorted((ROOT / top).rglob("*.py"))]


@pytest.mark.parametrize(
    ("statement", "remedy", "text"),
    [
        ("binning 2 was found", "use binning 1", "binning 2 was found; use binning 1"),
        ("binning 2 was found.", "use binning 1", "binning 2 was found; use binning 1"),
        ("binning is 2; needed is 1.", "Send 1.", "binning is 2; needed is 1. Send 1."),
        ("there is no token 7", "GET /tokens lists them", "there is no token 7; GET /tokens lists them"),
        ("there is no token 7.", "GET /tokens lists them", "there is no token 7; GET /tokens lists them"),
        ("binning 2 was found.", None, "binning 2 was found."),
        ("binning 2 was found", "", "binning 2 was found"),
        ("", "use binning 1", "use binning 1"),
        ("", None, ""),
    ],
)
def test_a_text_is_the_statement_and_the_remedy(statement: str, remedy: str | None, text: str) -> None:
    error = FoveaError(statement, remedy=remedy)

    assert (str(error), error.statement, error.remedy) == (text, statement, remedy)


@pytest.mark.parametrize(
    ("asked", "found", "statement"),
    [("binning 1", "it has 2", "binning 1: it has 2"), (None, "it has 2", "it has 2"), ("one", None, "one")],
)
def test_without_a_statement_it_is_composed_as_well(
    asked: str | None, found: str | None, statement: str
) -> None:
    error = FoveaError(asked=asked, found=found, remedy="use it")

    assert (error.statement, str(error)) == (statement, f"{statement}; use it")


@pytest.mark.parametrize(
    ("error", "parts"),
    [
        (FoveaError("it is gone; plug it in"), ("it is gone", "plug it in")),
        (
            FoveaError("it is gone; see its log", remedy="plug it in; try again"),
            ("it is gone; see its log", "plug it in; try again"),
        ),
        (FoveaError("it is gone"), ("it is gone", "")),
    ],
)
def test_a_remedy_that_is_not_given_follows_the_last_semicolon(
    error: FoveaError, parts: tuple[str, str]
) -> None:
    assert error.parts == parts


def test_an_error_keeps_its_parts_when_it_is_pickled() -> None:
    error = pickle.loads(pickle.dumps(Busy("it is in use", asked="a", found="b", remedy="wait")))  # noqa: S301 - its own

    assert isinstance(error, Busy)
    assert (str(error), error.statement) == ("it is in use; wait", "it is in use")
    assert (error.asked, error.found, error.remedy) == ("a", "b", "wait")


def text_of(node: ast.expr) -> str:
    """Return a literal text with its expressions in braces; of anything else, the expression in braces."""
    match node:
        case ast.Constant(value=str(text)):
            return text
        case ast.JoinedStr(values=parts):
            return "".join(text_of(part) for part in parts)
        case ast.FormattedValue(value=value):
            return f"{{{ast.unparse(value)}}}"
    return f"{{{ast.unparse(node)}}}"


def repeated_remedies(source: str) -> list[int]:
    """Return the lines of calls whose statement contains their remedy."""
    lines = []
    for call in ast.walk(ast.parse(source)):
        if not isinstance(call, ast.Call):
            continue
        remedies = [text_of(word.value) for word in call.keywords if word.arg == "remedy"]
        if any(remedy and remedy in text_of(call.args[0]) for remedy in remedies if call.args):
            lines.append(call.lineno)
    return lines


@pytest.mark.parametrize(
    ("call", "found"),
    [
        ('Busy("it is in use; wait", remedy="wait")', [1]),
        ('Busy("it is in use: wait, or go", remedy="wait")', [1]),
        ('Busy(f"{a} is in use; wait {n:g} s", remedy=f"wait {n} s")', [1]),
        ('Busy(f"it is in use; {remedy}", remedy=remedy)', [1]),
        ('Busy(f"{error}; 7 are kept; {error.remedy}", remedy=error.remedy)', [1]),
        ('Busy(f"{error.statement}; 7 are kept", remedy=error.remedy)', []),
        ('Busy(f"{a} is in use", remedy=f"wait for {a}")', []),
        ('Busy("it is in use", remedy="")', []),
        ('Busy("it is in use; wait")', []),
    ],
)
def test_a_statement_with_its_remedy_is_found(call: str, found: list[int]) -> None:
    assert repeated_remedies(call) == found


def test_no_statement_in_the_source_contains_its_remedy() -> None:
    assert len(PRODUCT) > 1000
    repeated = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in PRODUCT
        for line in repeated_remedies(path.read_text(encoding="utf-8"))
    ]

    assert repeated == []
