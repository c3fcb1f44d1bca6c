"""The processor time of every file of tests: its own and that of the processes which ended meanwhile.

A server that a folder shares counts for the file whose test ends it. Wall time would not do: with more tests
than cores each waits for the others.
"""

import json
import os
from collections import defaultdict
from collections.abc import Generator
from pathlib import Path

import pytest

COLLECTION = "(collection)"
"""Starting the processes and collecting, in all of them together."""
_KEY = "cpu_seconds"


def used_s() -> float:
    """Return the processor time of this process and of its children that have ended, s."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


class CpuSeconds:
    """Adds up what the tests use, in each process, and writes it where the run was started."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._by_file: defaultdict[str, float] = defaultdict(float)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Count one test with its fixtures."""
        before_s = used_s()
        result = yield
        self._by_file[item.path.relative_to(item.config.rootpath).as_posix()] += used_s() - before_s
        return result

    def pytest_collection_finish(self) -> None:
        """Count what has been used until now."""
        self._by_file[COLLECTION] += used_s()

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: object) -> None:
        """Add what a worker counted."""
        counted = getattr(node, "workeroutput", {}).get(_KEY, "{}")  # one that crashed has none
        for name, used in json.loads(counted).items():
            self._by_file[name] += used

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Hand it to the process that started this one, or write it, most first."""
        if (output := getattr(session.config, "workeroutput", None)) is not None:
            output[_KEY] = json.dumps(self._by_file)
            return
        most_first = sorted(self._by_file.items(), key=lambda one: -one[1])
        ordered = {name: round(used, 2) for name, used in most_first}
        self._path.write_text(json.dumps(ordered, indent=1) + "\n")
