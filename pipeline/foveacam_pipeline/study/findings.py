"""What a study found: vector graphics, the paper's numbers beside ours, definitions, seeds, deviations.

A study is computed by functions, and told by a `Study`: a frozen value that becomes JSON and comes back.
"""

import io
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field

from matplotlib import rc_context
from matplotlib.figure import Figure

Value = float | int | bool | str | None | list["Value"] | dict[str, "Value"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One number of the paper beside ours; `note` says what differs and why, or how it was measured."""

    quantity: str
    paper: str
    ours: str
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """One figure: `name` is its file's, `figure` which of the paper's it stands beside, if any."""

    name: str
    title: str
    caption: str
    svg: str
    figure: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """The findings of one section.

    `values`: the figures for programs, as `foveacam study NAME --json` prints them; keys carry units.
    `definitions`: what the words on the plots mean. `deviations`: what differs from the paper, and why.
    """

    name: str
    section: str
    title: str
    values: Mapping[str, Value]
    rows: tuple[Row, ...] = ()
    pictures: tuple[Picture, ...] = ()
    definitions: tuple[str, ...] = ()
    deviations: tuple[str, ...] = ()
    seeds: Mapping[str, int] = field(default_factory=dict)

    def document(self) -> dict[str, object]:
        """Return it as plain values."""
        return asdict(self)

    @classmethod
    def of(cls, document: Mapping[str, object]) -> "Study":
        """Return the study that `document()` gave, after JSON or before it."""
        plain = json.loads(json.dumps(document))
        rows = tuple(Row(**row) for row in plain.pop("rows"))
        pictures = tuple(Picture(**picture) for picture in plain.pop("pictures"))
        definitions, deviations = tuple(plain.pop("definitions")), tuple(plain.pop("deviations"))
        return cls(rows=rows, pictures=pictures, definitions=definitions, deviations=deviations, **plain)


def svg_of(drawn: Figure) -> str:
    """Return a figure as SVG text, the same for the same figure: no date, ids that do not change."""
    out = io.StringIO()
    with rc_context({"svg.hashsalt": "foveacam", "svg.fonttype": "path"}):
        drawn.savefig(out, format="svg", metadata={"Date": None}, bbox_inches="tight")
    text = out.getvalue()
    return text[text.index("<svg") :]
