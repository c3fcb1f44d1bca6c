import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from foveacam_web.viser_server import SocketFolder, clear_abandoned

KILLED = """
import os, signal
from foveacam_web.viser_server import SocketFolder
folder = SocketFolder()
folder.path.touch()
print(folder.path.parent, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    return tmp_path


def test_the_owner_alone_can_enter_and_nothing_is_left() -> None:
    folder = SocketFolder()
    assert stat.S_IMODE(folder.path.parent.stat().st_mode) == 0o700
    folder.path.touch()
    folder.close()
    assert not folder.path.parent.exists()


def test_what_a_killed_owner_left_is_removed_at_the_next_start(temporary: Path) -> None:
    killed = subprocess.run([sys.executable, "-c", KILLED], stdout=subprocess.PIPE, text=True, check=False)
    left = Path(killed.stdout.strip())
    assert left.parent == temporary
    assert left.is_dir()
    folder = SocketFolder()
    assert not left.exists()
    folder.close()


def test_the_folder_of_one_that_lives_stays(temporary: Path) -> None:
    folder = SocketFolder()
    folder.path.touch()
    clear_abandoned(temporary)
    assert folder.path.exists()
    folder.close()
