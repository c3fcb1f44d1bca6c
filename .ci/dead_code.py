"""Report code that nothing but tests uses, by vulture with the settings in pyproject.toml.

Vulture knows names alone. Here fields of a class that leaves Python as a whole count as used, and a name that
a package only imports and lists does not.
"""

import ast
import sys
from pathlib import Path

from vulture.config import make_config
from vulture.core import Item, Vulture

READ_OUTSIDE = {
    "BaseModel",  # clients and files
    "BaseSettings",  # the environment
    "StrEnum",  # members are found by their values
    "SeamFigures",  # mosaic.json
    "DepthFigures",
    "ReferenceSample",  # samples.csv
    "DepthBin",  # reference.json
    "BaselineComparison",
    "DatasetInfo",  # `foveacam dataset info --json`
    "TurningBase",  # the log
    "StudyFigure",  # the report's template
}
"""Classes whose fields, and those of their subclasses, are read or written as a whole."""


class FieldAwareVulture(Vulture):
    """Vulture that knows which class a field belongs to."""

    def __init__(self, *, ignore_names: list[str], ignore_decorators: list[str]) -> None:
        super().__init__(ignore_names=ignore_names, ignore_decorators=ignore_decorators)
        self._bases: dict[str, set[str]] = {}
        self._owners: dict[tuple[Path, int], str] = {}

    def visit_ClassDef(self, node: ast.ClassDef) -> None:  # noqa: N802 - vulture calls it by this name
        """Note the class's bases and the lines of its fields."""
        super().visit_ClassDef(node)
        self._bases[node.name] = {ast.unparse(base).partition("[")[0] for base in node.bases}
        for statement in node.body:
            if isinstance(statement, ast.Assign | ast.AnnAssign):
                self._owners[self.filename, statement.lineno] = node.name

    def visit_Assign(self, node: ast.Assign) -> None:  # noqa: N802
        """Take no name as used because `__all__` lists it."""

    def get_unused_code(self, min_confidence: int = 0, sort_by_size: bool = False) -> list[Item]:
        """Return what is unused, without fields that are read from outside."""
        found = super().get_unused_code(min_confidence, sort_by_size)
        return [item for item in found if not self._is_read_outside(item)]

    def _is_read_outside(self, item: Item) -> bool:
        owner = self._owners.get((item.filename, item.first_lineno), "")
        family, bases = {owner}, self._bases.get(owner, set())
        while new := bases - family:
            family |= new
            bases = {base for name in new for base in self._bases.get(name, set())}
        return not family.isdisjoint(READ_OUTSIDE)


def main() -> None:
    """Print unused code, one finding a line; exit with 3 where there is some."""
    config = make_config()
    search = FieldAwareVulture(
        ignore_names=config["ignore_names"], ignore_decorators=config["ignore_decorators"]
    )
    search.scavenge(config["paths"], exclude=config["exclude"])
    sys.exit(search.report(min_confidence=config["min_confidence"]))


if __name__ == "__main__":
    main()
