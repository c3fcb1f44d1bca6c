"""Temporary folders of far ends: removed with their owner, or by the next one when that was killed."""

import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from foveacam_hardware.sim.far_ends.far_end_process import (
    FOLDER_PREFIX,
    LOCK_FILE,
    PortFolder,
    remove_abandoned_folders,
)

KILLED = """
import os
from foveacam_hardware.sim.far_ends.far_end_process import PortFolder
folder = PortFolder()
(folder.path / "controller").symlink_to("/dev/pts/0")
print(folder.path, flush=True)
os._exit(1)
"""


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let the system's temporary folder be the test's, for child processes too."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    return tmp_path


def test_the_folder_of_a_killed_owner_goes_with_the_next_start(temporary: Path) -> None:
    killed = subprocess.run([sys.executable, "-c", KILLED], capture_output=True, text=True, check=False)
    left = Path(killed.stdout.strip())
    assert left.is_dir()
    assert left.parent == temporary

    folder = PortFolder()

    assert not left.exists()
    assert folder.path.is_dir()
    folder.close()


def test_the_folder_of_a_living_owner_stays(temporary: Path) -> None:
    alive = PortFolder()

    assert remove_abandoned_folders(temporary) == []
    assert alive.path.is_dir()
    alive.close()
    alive.close()
    assert not alive.path.exists()


def test_what_nobody_has_locked_yet_and_what_is_foreign_stays(temporary: Path) -> None:
    unnamed = temporary / f"{FOLDER_PREFIX}begun"
    unnamed.mkdir()
    (unnamed / f".{LOCK_FILE}").touch()
    foreign = temporary / "elsewhere"
    foreign.mkdir()
    (foreign / LOCK_FILE).touch()
    link = temporary / f"{FOLDER_PREFIX}link"
    link.symlink_to(foreign)

    assert remove_abandoned_folders(temporary) == []
    assert unnamed.is_dir()
    assert link.is_symlink()
    assert (foreign / LOCK_FILE).exists()
