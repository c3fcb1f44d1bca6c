"""Fill the tables of a Markdown page with figures of runs.

`<!-- figures: RUN | RUN | - -->` on the line before a table names the run of each column after the first; a
dash leaves a column as it is. A row's figures are those that its first cell names in backticks.
"""

import re
from collections.abc import Mapping

MARK = re.compile(r"<!-- figures: (.+) -->")
SEPARATOR = re.compile(r"\|[\s:|-]+\|")
KEY = re.compile(r"`(\w+)`")
CELL_END = re.compile(r"(?<!\\)\|")
UNRENDERED = "-"
Figures = Mapping[str, object]


def rendered(text: str, runs: Mapping[str, Figures], *, page: str) -> tuple[str, list[str]]:
    """Return a page with its tables filled, and what is wrong with it, a line each."""
    lines, problems = text.split("\n"), []
    for index, line in enumerate(lines):
        if mark := MARK.fullmatch(line.strip()):
            names = [name.strip() for name in mark[1].split("|")]
            if problem := _problem(lines[index + 1 : index + 3], names, runs):
                problems.append(f"{page}:{index + 1}: {problem}")
                continue
            row = index + 3
            while row < len(lines) and lines[row].startswith("|"):
                lines[row], missing = _row(lines[row], names, runs)
                row += 1
                problems += [f"{page}:{row}: {each}" for each in missing]
    return "\n".join(lines), problems


def _problem(head: list[str], names: list[str], runs: Mapping[str, Figures]) -> str | None:
    """Return why a table with this head cannot be filled at all."""
    if len(head) < 2 or not SEPARATOR.fullmatch(head[1].strip()):
        return "no table follows `<!-- figures: … -->`; write it directly before one"
    columns = len(_cells(head[0])) - 1
    if len(names) != columns:
        return f"{len(names)} runs are named for {columns} columns; name one for each, or a dash"
    for name in names:
        if name != UNRENDERED and name not in runs:
            return f"no run '{name}' is stored; correct its name, or make figures RUN='{name}'"
    return None


def _row(line: str, names: list[str], runs: Mapping[str, Figures]) -> tuple[str, list[str]]:
    """Return a filled row, and what is wrong with it."""
    cells, missing = _cells(line), []
    keys, row = KEY.findall(cells[0]), f"row '{cells[0]}'"
    if len(cells) != len(names) + 1:
        return line, [f"{row} has {len(cells) - 1} values for {len(names)} columns; correct it"]
    for column, name in enumerate(names, start=1):
        if name == UNRENDERED or not keys:
            continue
        absent = [key for key in keys if key not in runs[name]]
        missing += [f"{row}: '{name}' has no figure '{key}'; correct its name" for key in absent]
        if not absent:
            cells[column] = _filled(cells[column], [runs[name][key] for key in keys])
    return f"| {' | '.join(cells)} |", missing


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in CELL_END.split(line.strip().removeprefix("|").removesuffix("|"))]


def _filled(cell: str, values: list[object]) -> str:
    """Return a cell with other values and the remark in brackets that it has."""
    _, bracket, remark = f" {cell}".partition(" (")
    return ", ".join(map(shown, values)) + bracket + remark


def shown(value: object) -> str:
    """Return a figure as pages show it: three digits, thousands apart, `–` where nothing was measured."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return f"{value:,}".replace(",", " ")
    if not isinstance(value, float):
        return str(value)
    text = f"{value:.3g}"
    if abs(float(text)) >= 1000:
        return f"{float(text):,.0f}".replace(",", " ")
    if "e" in text:
        return text.replace("e-0", "e-")
    return text if "." in text or len(text.lstrip("-")) > 2 else f"{text}.0"
