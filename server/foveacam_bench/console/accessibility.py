"""Serious findings of axe-core on every page: barriers for people with poor sight or without a mouse.

axe-core comes with the sources alone, as a file of the page's tests.
"""

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from foveacam_bench.console.pages import (
    CONSOLE_PAGES,
    DOCUMENTS,
    LOOKS,
    apply_look,
    show_console_page,
    show_document,
)
from foveacam_bench.figures import Figures, Report
from foveacam_bench.progress import show_note
from foveacam_bench.stream.console_page import open_context, open_page
from foveacam_client.document import JsonObject

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

AXE = Path(__file__).parents[3] / "web" / "tests" / "vendored" / "axe-core" / "axe.min.js"
NO_AXE = (
    "axe_serious is null: axe-core is not at {axe}; it comes with a clone of the repository"
    " (git checkout -- web/tests/vendored), or in the npm package axe-core"
)
SERIOUS = {"serious", "critical"}
QUICK_PAGES, QUICK_DOCUMENTS = 2, 1
_RUN = """async (colours_alone) => {
  const all = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"];
  const found = await axe.run(document, {
    resultTypes: ["violations"],
    runOnly: colours_alone ? ["color-contrast"] : all,
    iframes: false,
  });
  return found.violations.map(({ id, impact, help, nodes }) => (
    { id, impact, help, nodes: nodes.map(({ html, failureSummary }) => ({ html, failureSummary })) }
  ));
}"""


def accessibility_figures(browser: "Browser", url: str, *, quick: bool, report: Report) -> Figures:
    """Check all pages in all looks; return the number of serious findings, and of pages times looks.

    `quick`: a few pages. The findings themselves are shown on stderr. Null where axe-core is missing.
    """
    if not AXE.is_file():
        show_note(NO_AXE.format(axe=AXE))
        return {"axe_serious": None, "axe_pages": 0}
    addresses = list(CONSOLE_PAGES)[: QUICK_PAGES if quick else None]
    documents = DOCUMENTS[: QUICK_DOCUMENTS if quick else None]
    found: list[str] = []
    with open_context(browser, scene=False) as context:
        page, beside = open_page(context, url), context.new_page()
        for look in LOOKS:
            report(f"accessibility, {look}")
            apply_look(page, look)
            for address in addresses:
                show_console_page(page, address)
                found += [f"{look} {address}: {line}" for line in serious_findings(page)]
            apply_look(beside, look)
            for path in documents:
                show_document(beside, url + path)
                found += [f"{look} /{path}: {line}" for line in serious_findings(beside)]
    for line in found:
        show_note(line)
    return {"axe_serious": len(found), "axe_pages": len(LOOKS) * (len(addresses) + len(documents))}


@cache
def _source() -> str:
    return AXE.read_text(encoding="utf-8")


def serious_findings(page: "Page", *, colours_alone: bool = False) -> list[str]:
    """Return the serious and critical findings of a page, one line each.

    `colours_alone`: of the contrast of its texts, where all else was checked in other colours.
    """
    if not page.evaluate("typeof axe === 'object'"):
        page.evaluate(_source())
    found: list[JsonObject] = page.evaluate(_RUN, colours_alone)
    return [
        f"{rule['id']} ({rule['help']}): {node['html'][:160]} | {_last_line(node['failureSummary'])}"
        for rule in found
        if rule["impact"] in SERIOUS
        for node in rule["nodes"]
    ]


def _last_line(text: str) -> str:
    return text.splitlines()[-1].strip()
