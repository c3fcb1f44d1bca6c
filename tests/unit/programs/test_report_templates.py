"""The reports' templates escape all text, name no value that they are not given, and are all in use."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from jinja2 import Environment, meta, nodes
from tests.support.scenes.report_session import drift_check, session_document

import foveacam_pipeline
import foveacam_server
from foveacam_pipeline.accept.values import Fault, Verdict
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.reports import page as reports
from foveacam_pipeline.study.report import page as study_page
from foveacam_pipeline.study.report.cache import CachedStudy
from foveacam_pipeline.study.report.findings import (
    Drawing,
    PaperComparison,
    StudyFigure,
    StudyResult,
    StudyTable,
)
from foveacam_server.resources.calibrating.acceptances import report as acceptance_page
from foveacam_server.resources.calibrating.acceptances.schema import (
    AcceptanceCheckDocument,
    AcceptanceDocument,
    AcceptanceFigureDocument,
    AcceptanceFindingDocument,
)
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.calibrating.report import page as calibration_page
from foveacam_server.resources.calibrating.sessions.schema import SessionDocument

HOSTILE = "\"'><script>alert(1)</script>"
FIXED = ("kind", "eye", "axis", "camera", "left", "right", "created_utc")
"""Strings of a session that its schema limits to a few words or a date."""


def hostile(value: Any) -> Any:  # noqa: ANN401 - parts of a JSON document
    """Return a document with hostile text at the end of every string."""
    if isinstance(value, dict):
        kept = {key: value[key] for key in FIXED if isinstance(value.get(key), str)}
        return {key: hostile(inside) for key, inside in value.items()} | kept
    if isinstance(value, list):
        return [hostile(inside) for inside in value]
    return value + HOSTILE if isinstance(value, str) else value


def calibration_report() -> str:
    calibration = load_calibration(SHIPPED / "sim-rig120.json")
    document = hostile(session_document())
    document["fit"]["parallax"] = {HOSTILE: document["fit"]["parallax"]["markers"]}
    return calibration_page.report_html(
        replace(calibration, label=HOSTILE, rig_id=HOSTILE, parent_id=HOSTILE),
        session=SessionDocument.model_validate(document),
        drift=[drift_check(1, shift_deg=0.1)],
        acceptances=[acceptance_run()],
    )


def acceptance_run() -> AcceptanceDocument:
    finding = AcceptanceFindingDocument(fault=Fault.NOISE, subject=HOSTILE, detail=HOSTILE, remedy=HOSTILE)
    figure = AcceptanceFigureDocument(name=HOSTILE, value=1.0, unit=HOSTILE, low=2.0, high=None, within=False)
    check = AcceptanceCheckDocument(
        name="timing",
        title=HOSTILE,
        verdict=Verdict.FAILED,
        figures=[figure],
        findings=[finding],
        note=HOSTILE,
        picture="timing",
    )
    return AcceptanceDocument(
        id=HOSTILE,
        created_utc="2026-01-02T03:04:05+00:00",
        rig_id=HOSTILE,
        calibration_id=HOSTILE,
        duration_s=1.0,
        complete=False,
        accepted=False,
        checks=[check],
    )


def acceptance_report() -> str:
    picture = b"\x89PNG\r\n\x1a\n" + bytes(40)
    return acceptance_page.report_html(
        acceptance_run(), pictures={"timing": picture}, table2=[(HOSTILE,) * 5]
    )


def study_report() -> str:
    drawn = Drawing(svg=f"<svg>{HOSTILE}</svg>", png_base64="")
    study = StudyResult(
        name=HOSTILE,
        section=HOSTILE,
        title=HOSTILE,
        values={HOSTILE: HOSTILE},
        rows=(PaperComparison(quantity=HOSTILE, paper=HOSTILE, ours=HOSTILE, note=HOSTILE),),
        pictures=(StudyFigure(name=HOSTILE, title=HOSTILE, caption=HOSTILE, drawing=drawn, figure=HOSTILE),),
        definitions=(HOSTILE,),
        deviations=(HOSTILE,),
        seeds={HOSTILE: 7},
        tables=(StudyTable(name=HOSTILE, title=HOSTILE, csv=""),),
        ended_early=HOSTILE,
    )
    cached = CachedStudy(study=study, took_s=2.0, made_utc="2026-01-02T03:04:05+00:00")
    reported = study_page.ReportedStudy(cached=cached, fresh=False)
    return study_page.report_html([reported], versions={HOSTILE: HOSTILE}, failed=[HOSTILE])


@pytest.mark.parametrize(
    ("report", "shown"), [(calibration_report, 25), (study_report, 27), (acceptance_report, 20)]
)
def test_hostile_text_is_escaped_everywhere(report: Callable[[], str], shown: int) -> None:
    page = report()
    assert page.count("&#34;&#39;&gt;&lt;script&gt;") == shown, (
        "places that show text of others, counted by hand"
    )
    assert "<script" not in page
    assert HOSTILE[:2] not in page


def reachable(environment: Environment, name: str) -> dict[str, nodes.Template]:
    """Return a template and all that it extends, includes or imports, by name."""
    assert environment.loader is not None
    tree = environment.parse(environment.loader.get_source(environment, name)[0])
    found = {name: tree}
    for other in meta.find_referenced_templates(tree):
        assert other is not None, "the name of a template is written out"
        found |= reachable(environment, other)
    return found


@pytest.mark.parametrize(
    ("module", "report"),
    [
        (calibration_page, calibration_report),
        (study_page, study_report),
        (acceptance_page, acceptance_report),
    ],
)
def test_a_template_gets_every_value_that_it_names_and_no_other(
    module: ModuleType, report: Callable[[], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    given: dict[str, object] = {}
    monkeypatch.setattr(module, "fill_template", lambda template, **values: given.update(values) or "")
    report()
    environment = reports._environment(Path(str(module.__file__)).parent)
    trees = reachable(environment, "report.html.j2").values()
    named = set().union(*(meta.find_undeclared_variables(tree) for tree in trees))
    own = {name.name for tree in trees for name in tree.find_all(nodes.Name) if name.ctx == "store"}
    own |= {macro.name for tree in trees for macro in tree.find_all(nodes.Macro)}
    assert named - own == set(given)


def test_every_template_is_part_of_a_report() -> None:
    used: set[str] = set()
    for module in (calibration_page, study_page, acceptance_page):
        environment = reports._environment(Path(str(module.__file__)).parent)
        for name in reachable(environment, "report.html.j2"):
            assert environment.loader is not None
            used.add(str(environment.loader.get_source(environment, name)[1]))
    packages = (Path(package.__file__ or "").parent for package in (foveacam_pipeline, foveacam_server))
    assert {str(path) for folder in packages for path in folder.rglob("*.j2")} <= used
