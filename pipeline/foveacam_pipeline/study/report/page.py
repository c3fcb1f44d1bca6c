"""The HTML report of the studies: one page without external resources, the paper's numbers beside ours."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from foveacam_pipeline.reports.page import fill_template
from foveacam_pipeline.study.report.cache import CachedStudy
from foveacam_pipeline.study.report.findings import StudyResult, StudyTable, Value

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
    was not finished. Raise InvalidInput for a figure that is no SVG.
    """
    ordered = sorted(studies, key=lambda one: (one.study.section, one.study.name))
    values = {key: value for one in ordered for key, value in one.study.values.items()}
    return fill_template(
        Path(__file__).with_name("report.html.j2"),
        studies=ordered,
        versions=versions,
        failed=failed,
        table_file=table_file,
        value_text=value_text,
        tiles=[
            (words, form.format(value))
            for key, (words, form) in HEADLINES.items()
            if isinstance(value := values.get(key), int | float)
        ],
        links=[(one.study.name, f"{one.study.section} {one.study.title}") for one in ordered],
    )


def table_file(study: StudyResult, table: StudyTable) -> str:
    """Return the name of the file in which a table lies beside the report."""
    return f"{study.name}-{table.name}.csv"


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
