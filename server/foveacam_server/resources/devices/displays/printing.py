"""Prints the pattern of a request: sheets of paper at true size, as PDF."""

from dataclasses import dataclass

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.sheets import lay_out, pattern_pdf, sheets_words
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.plain_words import validated
from foveacam_server.resources.devices.displays.drawing import MARKER_DICTIONARY, draw
from foveacam_server.resources.devices.displays.schema import (
    CharucoPattern,
    CheckerboardPattern,
    PrintQuery,
    ShownPattern,
    StoredPattern,
)

_OF_THE_PRINT = {"dictionary", "paper", "margin_mm"}


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternPrint:
    """A pattern as PDF, with its description and number of sheets in words."""

    pattern: ShownPattern
    content: bytes
    description: str
    sheets: str

    @property
    def file_name(self) -> str:
        """File name, made from the pattern's kind."""
        return f"{self.pattern.kind}.pdf"


def asked_pattern(query: PrintQuery) -> ShownPattern | None:
    """Return the pattern of a query, None without one; raise `InvalidInput` for an incomplete pattern."""
    given = query.model_dump(exclude=_OF_THE_PRINT, exclude_none=True)
    return validated(StoredPattern, {"pattern": given}).pattern if given else None


def print_pattern(pattern: ShownPattern, query: PrintQuery) -> PatternPrint:
    """Return the print of a pattern on the paper of a query; raise `NotFound` when it is blank."""
    if query.dictionary is not None and not isinstance(pattern, CharucoPattern):
        raise InvalidInput(
            f"dictionary {query.dictionary}: a {pattern.kind} pattern has no choice of it; leave it out"
        )
    dictionary = query.dictionary or MARKER_DICTIONARY
    drawing = draw(pattern, dictionary=dictionary)
    if drawing.pattern is None:
        raise NotFound(
            "no pattern is shown, so there is none to print",
            asked="the pattern as PDF",
            found="blank",
            remedy="name its kind and its numbers in the query",
        )
    words = f"{drawing.description}{_squares_words(pattern, dictionary=dictionary)}"
    sheets = lay_out(
        drawing.pattern,
        paper=query.paper,
        margin_m=query.margin_mm / 1e3,
        words=f"{words}; print at 100 %",
    )
    return PatternPrint(
        pattern=pattern,
        content=pattern_pdf(sheets, title=words),
        description=words,
        sheets=sheets_words(sheets, paper=query.paper),
    )


def _squares_words(pattern: ShownPattern, *, dictionary: str) -> str:
    """Return the squares and markers of a board in words, which its description leaves out."""
    if not isinstance(pattern, CharucoPattern | CheckerboardPattern):
        return ""
    columns, rows = pattern.columns + 1, pattern.rows + 1
    squares = f" ({columns} x {rows} squares)"
    if isinstance(pattern, CheckerboardPattern):
        return squares
    last = columns * rows // 2 - 1
    return f"{squares}, markers 0 to {last} of {dictionary}, side {pattern.marker_mm:g} mm"
