"""The result of a study: figures, the paper's numbers beside ours, definitions, seeds, deviations.

Every study returns a `StudyResult`, a frozen value that is converted to JSON and back without loss.
"""

import io
import json
from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field

from matplotlib import rc_context
from matplotlib.figure import Figure

Value = float | int | bool | str | None | list["Value"] | dict[str, "Value"]
PNG_DPI = 150


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperComparison:
    """One number of the paper beside ours; `note` says what differs and why, or how it was measured."""

    quantity: str
    paper: str
    ours: str
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """A figure as SVG text, and as a PNG file in base64 for JSON."""

    svg: str
    png_base64: str

    @property
    def png(self) -> bytes:
        """The content of the PNG file."""
        return b64decode(self.png_base64)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyFigure:
    """One figure of the report: `name` names its files, `figure` the paper's that it reproduces, if any."""

    name: str
    title: str
    caption: str
    drawing: Drawing
    figure: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyTable:
    """Single measurements of a study as CSV text with a header; `name` names its file."""

    name: str
    title: str
    csv: str


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyResult:
    """The result of one study.

    `values`: the numbers for programs, as `foveacam study NAME --json` prints them; keys carry units.
    `definitions`: what the terms on the plots mean. `deviations`: what differs from the paper, and why.
    `ended_early`: of a study that was cancelled, how much of it is in; such a result is not cached.
    """

    name: str
    section: str
    title: str
    values: Mapping[str, Value]
    rows: tuple[PaperComparison, ...] = ()
    pictures: tuple[StudyFigure, ...] = ()
    definitions: tuple[str, ...] = ()
    deviations: tuple[str, ...] = ()
    seeds: Mapping[str, int] = field(default_factory=dict)
    tables: tuple[StudyTable, ...] = ()
    ended_early: str = ""

    def document(self) -> dict[str, object]:
        """Return plain values for JSON."""
        return asdict(self)

    @classmethod
    def from_document(cls, document: Mapping[str, object]) -> "StudyResult":
        """Return the study from what `document()` returned, also after a round trip through JSON."""
        plain = json.loads(json.dumps(document))
        rows = tuple(PaperComparison(**row) for row in plain.pop("rows"))
        pictures = tuple(
            StudyFigure(drawing=Drawing(**picture.pop("drawing")), **picture)
            for picture in plain.pop("pictures")
        )
        tables = tuple(StudyTable(**table) for table in plain.pop("tables"))
        definitions, deviations = tuple(plain.pop("definitions")), tuple(plain.pop("deviations"))
        return cls(
            rows=rows,
            pictures=pictures,
            tables=tables,
            definitions=definitions,
            deviations=deviations,
            **plain,
        )


def drawing_of(drawn: Figure) -> Drawing:
    """Return a figure as SVG and PNG; equal figures give equal bytes (no date, fixed ids)."""
    svg, png = io.StringIO(), io.BytesIO()
    with rc_context({"svg.hashsalt": "foveacam", "svg.fonttype": "path"}):
        drawn.savefig(svg, format="svg", metadata={"Date": None}, bbox_inches="tight")
    drawn.savefig(png, format="png", dpi=PNG_DPI, bbox_inches="tight")
    text = svg.getvalue()
    return Drawing(svg=text[text.index("<svg") :], png_base64=b64encode(png.getvalue()).decode())
