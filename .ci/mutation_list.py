"""Small wrong changes of the product, listed in tests/mutations, each of which some test should notice."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "tests" / "mutations"


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutation:
    """One change.

    `fault`: what is wrong then, in words. `path`: of the file, relative to the root. `find`: what stands
    there exactly once, and `replace` takes its place. `also`: files of tests that reach it through the whole
    application alone and are to be run too.
    """

    fault: str
    path: str
    find: str
    replace: str
    also: tuple[str, ...] = ()

    def lines(self, source: str) -> range:
        """Return the lines of the file that are changed, counted from 1."""
        first = source[: source.index(self.find)].count("\n") + 1
        return range(first, first + self.find.rstrip("\n").count("\n") + 1)

    def applied(self, source: str) -> str:
        """Return the file's text with the change."""
        return source.replace(self.find, self.replace)

    def objection(self, root: Path) -> str:
        """Return why the change cannot be made, empty if it can."""
        if not (root / self.path).is_file():
            return f"{self.path} does not exist"
        source = (root / self.path).read_text(encoding="utf-8")
        if (found := source.count(self.find)) != 1:
            return f"{self.path} has {self.find!r} {found} times, and must have it once"
        if self.find == self.replace:
            return "it changes nothing"
        try:
            compile(self.applied(source), self.path, "exec")
        except SyntaxError as error:
            return f"{self.path} is no Python then: {error}"
        return ""


def load(paths: list[Path], *, root: Path = ROOT) -> list[Mutation]:
    """Read lists of mutations.

    Raises:
        ValueError: Some cannot be applied, each named, or two state one fault.
    """
    found: list[Mutation] = []
    for path in paths:
        for entry in tomllib.loads(path.read_text(encoding="utf-8"))["mutation"]:
            found.append(Mutation(**{**entry, "also": tuple(entry.get("also", ()))}))
    objections = [f"{each.fault!r}: {why}" for each in found if (why := each.objection(root))]
    faults = [each.fault for each in found]
    twice = {fault for fault in faults if faults.count(fault) > 1}
    objections += [f"{fault!r} is listed twice" for fault in sorted(twice)]
    if objections:
        raise ValueError("\n".join(objections))
    return found
