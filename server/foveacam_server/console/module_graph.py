"""The modules that a page's scripts import at their start, read from the import statements of the files."""

import re
from pathlib import Path

_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_STATIC_IMPORT = re.compile(r'^(?:import|export)\b[^;"(]*"(\.{1,2}/[^"]+)"', re.MULTILINE)
"""Matches an import or export of a relative module; `import("…")` is loaded later."""


def start_modules(entry: Path) -> list[Path]:
    """Return `entry` and every module that it imports, directly or not, nearest first."""
    found = {entry.resolve(): None}
    for module in (waiting := list(found)):
        text = _COMMENT.sub("", module.read_text(encoding="utf-8"))
        for address in _STATIC_IMPORT.findall(text):
            imported = (module.parent / address).resolve()
            if imported not in found:
                found[imported] = None
                waiting.append(imported)
    return list(found)
