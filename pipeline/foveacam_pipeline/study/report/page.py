"""The HTML report of the studies: one page without external resources, the paper's numbers beside ours."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.reports.markup import drawing, facts, moment, section, table
from foveacam_pipeline.reports.style import STYLE
from foveacam_pipeline.study.report.cache import CachedStudy
from foveacam_pipeline.study.report.findings import StudyFigure, StudyResult, StudyTable, Value

POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
TITLE = "Foveated stereo: the analyses of the paper"
HEADLINES: Mapping[str, tuple[str, str]] = {
    "mc_outside_3se": ("closed forms outside 3 standard errors", "{:.0f}"),
    "fig9_r2_multi": ("R² of the quadratic, Fig. 9, multi", "{:.4f}"),
    "fig8_agreement": ("Fig. 8: positions as predicted", "{:.1%}"),
    "region_speedup": ("exact region over a test of cells", "{:.0f}×"),
    "ratio_10m": ("Fig. 4: fovea over wide error at 10 m", "{:.3f}"),
    "t_absrel_mean": ("near-far ratio T, AbsRel", "{:.2f}"),
    "attention_exponent": ("exponent of attention's time", "{:.2f}"),
}
"""Values shown at the top of the report where a study has them: label and number format."""
_STYLE = """
figure svg.plot { max-width:820px; max-height:none; margin:0 auto; background:#fff; border-radius:5px; }
.plots { display:grid; grid-template-columns:minmax(0,1fr); gap:1rem; margin:1rem 0; }
.plots h3 { margin:0 0 .4rem; }
.beside td:nth-child(3) { font-weight:650; } .beside td:nth-child(4) { color:var(--soft); font-size:.88rem; }
.beside table { table-layout:fixed; min-width:34rem; } .beside th { width:22%; }
.beside th:nth-child(4) { width:34%; }
.beside td, .beside td.n, .beside th.n { overflow-wrap:anywhere; text-align:left; white-space:normal; }
ul { margin:.4rem 0; padding-left:1.2rem; max-width:80ch; } li { margin:.25rem 0; }
details { margin:.8rem 0; } summary { cursor:pointer; color:var(--accent); }
@media (max-width:640px) { figure svg.plot { min-width:34rem; }
  .beside table { min-width:0; } .beside thead { display:none; }
  .beside tr { display:grid; grid-template-columns:1fr 1fr;
    border-bottom:1px solid var(--line); padding:.3rem 0; }
  .beside td { border:0; padding:.1rem .5rem; } .beside td:empty { display:none; }
  .beside td:nth-child(1), .beside td:nth-child(4) { grid-column:1/-1; }
  .beside td:nth-child(2)::before { content:"paper: "; color:var(--soft); }
  .beside td:nth-child(3)::before { content:"ours: "; color:var(--soft); font-weight:400; } }
@media print { figure svg.plot { max-height:200mm; } }
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportedStudy:
    """A study for the report; `fresh` unless it was read from the cache."""

    cached: CachedStudy
    fresh: bool

    @property
    def study(self) -> StudyResult:
        """The result of the study."""
        return self.cached.study


def report_html(
    studies: Sequence[ReportedStudy], *, versions: Mapping[str, str], failed: Iterable[str] = ()
) -> str:
    """Return the report of some studies as one HTML page.

    `versions`: names of programs and libraries with their versions. `failed`: a sentence for each study that
    was not finished. Raise InvalidInput for a figure whose SVG is no drawing or has scripts.
    """
    ordered = sorted(studies, key=lambda one: (one.study.section, one.study.name))
    parts = [
        _header(ordered),
        *(f'<p class="absent"><b>Missing:</b> {escape(line)}</p>' for line in failed),
        *(_study(one) for one in ordered),
        _footer(ordered, versions),
    ]
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(TITLE)}</title>\n<style>{STYLE}{_STYLE}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(parts)
        + "\n</main>\n</body>\n</html>\n"
    )


def _header(studies: Sequence[ReportedStudy]) -> str:
    links = "".join(
        f'<a href="#{escape(one.study.name, quote=True)}">{escape(_heading(one.study))}</a>'
        for one in studies
    )
    values = {key: value for one in studies for key, value in one.study.values.items()}
    tiles = "".join(
        f'<div class="tile"><b>{escape(form.format(value))}</b><span>{escape(words)}</span></div>'
        for key, (words, form) in HEADLINES.items()
        if isinstance(value := values.get(key), int | float)
    )
    shown = f'<div class="tiles">{tiles}</div>' if tiles else ""
    about = "Figures of the paper, computed here; the paper's numbers beside ours."
    return (
        f'<header><h1>{escape(TITLE)}</h1><p class="under">{escape(about)}</p>{shown}'
        f'<nav aria-label="Studies">{links}</nav></header>'
    )


def _heading(study: StudyResult) -> str:
    return f"{study.section} {study.title}"


def _study(reported: ReportedStudy) -> str:
    study = reported.study
    rows = [(row.quantity, row.paper, row.ours, row.note) for row in study.rows]
    beside = table(("quantity", "paper", "ours", "remarks"), rows) if rows else ""
    early = f'<p class="absent"><b>Not complete:</b> {escape(study.ended_early)}</p>'
    return section(
        study.name,
        _heading(study),
        early if study.ended_early else "",
        beside.replace('<div class="scroll">', '<div class="scroll beside">', 1),
        _pictures(study),
        _list("Definitions", study.definitions),
        _list("What differs from the paper, and why", study.deviations),
        _list("Tables beside this page", [f"{one.title}: {table_file(study, one)}" for one in study.tables]),
        _values(study),
        f'<p class="under">{escape(_origin(reported))}</p>',
    )


def _pictures(study: StudyResult) -> str:
    shown = "".join(_picture(study, picture) for picture in study.pictures)
    return f'<div class="plots">{shown}</div>' if shown else ""


def _picture(study: StudyResult, picture: StudyFigure) -> str:
    title = f"{picture.figure}: {picture.title}" if picture.figure else picture.title
    svg = inline_svg(picture.drawing.svg, name=f"{study.name}-{picture.name}", label=title)
    return drawing(f'<h3>{escape(title)}</h3><div class="scroll">{svg}</div>', picture.caption)


def table_file(study: StudyResult, table: StudyTable) -> str:
    """Return the name of the file in which a table lies beside the report."""
    return f"{study.name}-{table.name}.csv"


def _list(title: str, lines: Sequence[str]) -> str:
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<h3>{escape(title)}</h3><ul>{items}</ul>" if items else ""


def _values(study: StudyResult) -> str:
    pairs = [(key, value_text(value)) for key, value in study.values.items()]
    return (
        f"<details><summary>All values, as a program gets them</summary>{facts(pairs)}</details>"
        if pairs
        else ""
    )


def value_text(value: Value) -> str:
    """Return a value as text: floats with four digits, None as a dash."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(value_text(item) for item in value)
    if isinstance(value, dict):
        return "; ".join(f"{key}: {value_text(item)}" for key, item in value.items())
    return str(value)


def _origin(reported: ReportedStudy) -> str:
    seeds = ", ".join(f"{name} {seed}" for name, seed in reported.study.seeds.items())
    parts = [f"Computed {moment(reported.cached.made_utc)} in {reported.cached.took_s:.1f} s"]
    parts += [] if reported.fresh else ["kept since, as nothing that it depends on has changed"]
    parts += [f"seeds: {seeds}"] if seeds else []
    return "; ".join(parts) + "."


def _footer(studies: Sequence[ReportedStudy], versions: Mapping[str, str]) -> str:
    took_s = sum(one.cached.took_s for one in studies)
    used = ", ".join(f"{name} {version}" for name, version in versions.items())
    lines = [f"All studies together took {took_s:.0f} s.", f"Made with {used}."]
    return "<footer>" + "".join(f"<p>{escape(line)}</p>" for line in lines) + "</footer>"


_ID = re.compile(r'\bid="([^"]+)"')
_LINK = re.compile(r'(\b(?:xlink:)?href="|url\()#')
_METADATA = re.compile(r"<metadata>.*?</metadata>\s*", re.DOTALL)
_STYLE_ELEMENT = re.compile(r"<defs>\s*<style[^>]*>.*?</style>\s*</defs>\s*", re.DOTALL)
_OPENING = re.compile(r"<svg\b[^>]*>")
_VIEW = re.compile(r'viewBox="[^"]+"')
_ACTIVE = re.compile(r"<script\b|<foreignObject\b|\son\w+\s*=|javascript:", re.IGNORECASE)
_NAME = re.compile(r"[a-z0-9-]+")


def inline_svg(svg: str, *, name: str, label: str) -> str:
    """Return a drawing for use inside a page: `name` prefixes its ids, `label` is what a screen reader says.

    The page chooses its size. The style rule that matplotlib writes for all elements of the document becomes
    an attribute of the drawing; its metadata are removed. Raise InvalidInput for a name of other characters
    than a-z, 0-9 and -, and for SVG that is no drawing or has scripts.
    """
    opening, view = _OPENING.search(svg), _VIEW.search(svg)
    if opening is None or view is None or _ACTIVE.search(svg):
        raise InvalidInput(f"picture {name!r}: an SVG drawing without scripts is needed; draw it again")
    if not _NAME.fullmatch(name):
        raise InvalidInput(f"picture {name!r}: its name is made of a-z, 0-9 and -; choose such a name")
    inside = svg[opening.end() :]
    inside = _STYLE_ELEMENT.sub("", _METADATA.sub("", inside))
    inside = _LINK.sub(rf"\1#{name}-", _ID.sub(rf'id="{name}-\1"', inside))
    return (
        f'<svg class="plot" {view.group(0)} role="img" aria-label="{escape(label, quote=True)}" '
        'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'stroke-linejoin="round" stroke-linecap="butt">{inside}'
    )
