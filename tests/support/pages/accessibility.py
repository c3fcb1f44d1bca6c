"""axe-core in a page: what a person with a screen reader, a keyboard or weak eyes would stumble over."""

from functools import cache
from pathlib import Path
from typing import Any

from playwright.sync_api import Page

AXE = Path(__file__).parents[3] / "web" / "tests" / "vendored" / "axe-core" / "axe.min.js"
SERIOUS = {"serious", "critical"}
RUN = """async () => {
  const found = await axe.run(document, {
    resultTypes: ["violations"],
    runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"],
    iframes: false,
  });
  return found.violations.map(({ id, impact, help, nodes }) => (
    { id, impact, help, nodes: nodes.map(({ html, failureSummary }) => ({ html, failureSummary })) }
  ));
}"""


@cache
def _source() -> str:
    return AXE.read_text(encoding="utf-8")


def serious_findings(page: Page) -> list[str]:
    """Return the serious and critical findings of a page, one line each."""
    if not page.evaluate("typeof axe === 'object'"):
        page.evaluate(_source())
    found: list[dict[str, Any]] = page.evaluate(RUN)  # Any: axe's findings
    return [
        f"{rule['id']} ({rule['help']}): {node['html'][:160]} | {_last_line(node['failureSummary'])}"
        for rule in found
        if rule["impact"] in SERIOUS
        for node in rule["nodes"]
    ]


def _last_line(text: str) -> str:
    return text.splitlines()[-1].strip()
