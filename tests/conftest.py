"""Runs before any test: options of the test run, and what a library reads when it is imported."""

import os

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Offer to run the contracts on a real rig."""
    parser.addoption(
        "--rig", default=None, metavar="FILE", help="run the contracts on the rig of this rig file"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Give every process of the tests three emulated Basler cameras."""
    os.environ.setdefault("PYLON_CAMEMU", "3")
