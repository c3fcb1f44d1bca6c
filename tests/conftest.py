"""Runs before any test: options of the test run, and what a library reads when it is imported."""

import os
from itertools import zip_longest
from pathlib import Path

import pytest
from hypothesis import settings

CONTROLLER_PORT = "FOVEACAM_CONTROLLER_PORT"
"""Names the port of a mirror controller that is none of ours."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Offer to run the contracts on a real rig."""
    parser.addoption(
        "--rig", default=None, metavar="FILE", help="run the contracts on the rig of this rig file"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Give every process of the tests three emulated Basler cameras, and examples the time they take."""
    os.environ.setdefault("PYLON_CAMEMU", "3")
    # A moment in which this machine stands still is no failure of an example
    settings.register_profile("busy", deadline=None)
    settings.load_profile("busy")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what needs a controller that nobody named, and put the files into a good order."""
    if not os.environ.get(CONTROLLER_PORT):
        absent = [item for item in items if item.get_closest_marker("external_controller")]
        items[:] = [item for item in items if item not in absent]
        config.hook.pytest_deselected(items=absent)
    _alternate(items)


def _alternate(items: list[pytest.Item]) -> None:
    """Let the files that drive a browser alternate with those that wait for a rig.

    Two workers take whole files in this order: one uses what the other leaves.
    """
    files: dict[Path, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(item.path, []).append(item)
    driving = [path for path, found in files.items() if found[0].get_closest_marker("browser")]
    waiting = [
        path for path in files if path not in driving and path.parent.name in ("system", "integration")
    ]
    first = [path for pair in zip_longest(driving, waiting) for path in pair if path is not None]
    rest = [path for path in files if path not in first]
    items[:] = [item for path in [*first, *rest] for item in files[path]]
