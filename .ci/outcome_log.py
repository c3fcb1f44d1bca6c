"""A plug-in of pytest: writes how each test ended and how long it took, for programs that run tests."""

import json
import os
from pathlib import Path

import pytest

LOG = "OUTCOME_LOG"
"""The variable that names the file; a line of JSON for each test."""


class _Log:
    def __init__(self, path: Path) -> None:
        self._path = path
        self._seconds: dict[str, float] = {}
        self._passed: dict[str, bool] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        name = report.nodeid
        self._seconds[name] = self._seconds.get(name, 0.0) + report.duration
        self._passed[name] = self._passed.get(name, True) and report.passed
        if report.when == "teardown":
            entry = {"test": name, "passed": self._passed.pop(name), "seconds": self._seconds.pop(name)}
            with self._path.open("a", encoding="utf-8") as file:
                file.write(f"{json.dumps(entry)}\n")


def pytest_configure(config: pytest.Config) -> None:
    """Write the log, in the process that collects all results."""
    if LOG in os.environ and not hasattr(config, "workerinput"):
        config.pluginmanager.register(_Log(Path(os.environ[LOG])))
