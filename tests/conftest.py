"""Runs before any test: options of the test run, and what a library reads when it is imported."""

import os
from itertools import zip_longest
from pathlib import Path

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Offer to run the contracts on a real rig."""
    parser.addoption(
        "--rig", default=None, metavar="FILE", help="run the contracts on the rig of this rig file"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Give every process of the tests three emulated Basler cameras."""
    os.environ.setdefault("PYLON_CAMEMU", "3")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let files that drive a browser alternate with those that wait for a rig, all others spread among them.

    Three workers take whole files in this order: on the average two have a server or a browser, which cost
    time for as long as they live, and one computes, so that no core waits.
    """
    files: dict[Path, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(item.path, []).append(item)
    driving = [path for path, found in files.items() if found[0].get_closest_marker("browser")]
    waiting = [path for path in files if path not in driving and path.parent.name == "system"]
    slow = [path for pair in zip_longest(driving, waiting) for path in pair if path is not None]
    quick = [path for path in files if path not in slow]
    items[:] = [item for path in spread(quick, among=slow) for item in files[path]]


def spread(many: list[Path], *, among: list[Path]) -> list[Path]:
    """Return `among` with `many` evenly between, both in their order; a fifth of `many` comes at the end."""
    if not among:
        return many
    share = 0.8 * len(many) / len(among)
    mixed: list[Path] = []
    for index, path in enumerate(among):
        mixed += [path, *many[round(index * share) : round((index + 1) * share)]]
    return [*mixed, *many[round(len(among) * share) :]]
