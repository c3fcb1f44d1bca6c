"""The report: every figure inline, ids that do not clash, nothing loaded, all text escaped."""

import re
from urllib.parse import unquote

import pytest
from matplotlib.figure import Figure

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.reports.page import picture_url
from foveacam_pipeline.study.report.cache import CachedStudy
from foveacam_pipeline.study.report.findings import (
    Drawing,
    PaperComparison,
    StudyFigure,
    StudyResult,
    drawing_of,
)
from foveacam_pipeline.study.report.page import ReportedStudy, report_html, value_text


def drawn() -> Drawing:
    figure = Figure(figsize=(3.0, 2.0))
    axes = figure.subplots()
    axes.plot([1.0, 2.0, 3.0], [1.0, 4.0, 9.0], "o-", label="area, m²")
    axes.legend()
    return drawing_of(figure)


def reported_study(name: str, section: str, *, fresh: bool = True) -> ReportedStudy:
    study = StudyResult(
        name=name,
        section=section,
        title=f"About {name} & <more>",
        values={"fig8_agreement": 0.973, "gaps": [1.0, 2.5], "missing": None},
        rows=(PaperComparison(quantity="R²", paper="not given", ours="0.9991", note="ten <maps>"),),
        pictures=(StudyFigure(name="area", title="Area", caption="a < b", drawing=drawn(), figure="Fig. 9"),),
        definitions=("multi: union over targets",),
        deviations=("Eq. 9: the sign",),
        seeds={"maps": 7},
    )
    return ReportedStudy(
        cached=CachedStudy(study=study, took_s=2.0, made_utc="2026-01-02T03:04:05+00:00"), fresh=fresh
    )


def page() -> str:
    return report_html(
        [reported_study("tokens", "4.3"), reported_study("depth", "4.1", fresh=False)],
        versions={"foveacam-duo": "1.2"},
        failed=["fig8: the <rig> was lost"],
    )


def test_pictures_are_files_of_their_own_whose_ids_and_styles_reach_nothing_else() -> None:
    html = page()
    ids = re.findall(r'\bid="([^"]+)"', html)
    assert sorted(ids) == ["depth", "tokens"]
    assert html.count("<style") == 1
    shown = [unquote(found) for found in re.findall(r'src="data:image/svg\+xml,([^"]+)"', html)]
    assert shown == [drawn().svg, drawn().svg]


def test_it_loads_nothing_and_runs_nothing() -> None:
    html = page()
    assert "default-src 'none'" in html
    assert "<script" not in html
    sources = re.findall(r'(?:src|href)="(.)', html)
    assert set(sources) == {"d", "#"}, "data URLs and sections of the page"


def test_it_tells_all_that_a_study_says_in_the_order_of_the_sections() -> None:
    html = page()
    assert html.index("4.1 About depth") < html.index("4.3 About tokens")
    for words in (
        "About depth &amp; &lt;more&gt;",
        "ten &lt;maps&gt;",
        "a &lt; b",
        "the &lt;rig&gt; was lost",
        "multi: union over targets",
        "Eq. 9: the sign",
        "97.3%",
        "seeds: maps 7",
        "kept since",
        "foveacam-duo 1.2",
        "4 s",
        "Fig. 9: Area",
    ):
        assert words in html, words


def test_what_is_no_drawing_is_refused() -> None:
    with pytest.raises(InvalidInput, match="picture 'area'"):
        picture_url("<p>no drawing</p>", "area")


def test_values_are_told_in_words() -> None:
    assert value_text({"a": [1, 2.34567], "b": None, "c": True}) == "a: 1, 2.346; b: –; c: yes"
