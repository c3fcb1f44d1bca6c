"""The lock names a release with hashes for everything that pyproject.toml needs, and one that it allows."""

import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = {"run": ("figures",), "image": ("figures", "films", "telemetry", "cluster"), "dev": ("dev",)}
OF_THE_MACHINE = {"torch"}
"""Packages that the lock leaves to the machine."""


def required(extras: tuple[str, ...]) -> list[Requirement]:
    """Return the requirements of the project with extras, and with those that they name."""
    found = [Requirement(text) for text in PROJECT["dependencies"]]
    for extra in extras:
        for requirement in map(Requirement, PROJECT["optional-dependencies"][extra]):
            if requirement.name == PROJECT["name"]:
                found += required(tuple(requirement.extras))
            else:
                found.append(requirement)
    return found


def pins(name: str) -> dict[str, list[str]]:
    """Return the releases of each package; several where they differ by Python's version."""
    found: dict[str, list[str]] = {}
    text = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8")
    for package in re.split(r"\n(?=[a-z0-9])", text)[1:]:
        pinned = re.match(r"([a-z0-9.-]+)(?:\[[^]]*\])?==([^ ;]+)", package)
        assert pinned is not None and "--hash=sha256:" in package, package[:80]
        found.setdefault(canonicalize_name(pinned[1]), []).append(pinned[2])
    return found


@pytest.mark.parametrize("name", EXTRAS)
def test_the_lock_satisfies_the_project(name: str) -> None:
    locked = pins(name)
    missing = [
        str(requirement)
        for requirement in required(EXTRAS[name])
        if requirement.name not in OF_THE_MACHINE
        and not any(
            requirement.specifier.contains(release, prereleases=True)
            for release in locked.get(canonicalize_name(requirement.name), [])
        )
    ]
    assert not missing, f"requirements/{name}.txt lacks {', '.join(missing)}; run `make update`"


def test_all_files_of_the_lock_have_the_same_releases() -> None:
    whole = pins("dev")
    for name in ("run", "image"):
        others = {package: releases for package, releases in pins(name).items() if package in whole}
        assert others == {package: whole[package] for package in others}
