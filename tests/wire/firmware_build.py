"""Compiles the controller's firmware for this machine, once a test run."""

import functools
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[2] / "hardware" / "firmware"
SANITIZERS = "address,undefined"


def built(name: str, *, sanitized: bool = False) -> Path:
    """Return one of the Makefile's products; skip the test where nothing can compile."""
    missing = [tool for tool in ("make", "cc") if shutil.which(tool) is None]
    if missing:
        pytest.skip(f"no {' and no '.join(missing)} on this machine: run tests/system/install-compiler.sh")
    return _make(name, SANITIZERS if sanitized and _can_sanitize() else "")


class _Folder:
    """Where products go; it goes with the process."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="fovea-firmware-")
        self.path = Path(self._folder.name)


@functools.cache
def _folder(sanitize: str) -> _Folder:
    del sanitize  # a folder for each
    return _Folder()


@functools.cache
def _make(name: str, sanitize: str) -> Path:
    folder = _folder(sanitize).path
    command = ["make", "--silent", "--directory", str(SOURCES), f"OUT={folder}", f"SANITIZE={sanitize}"]
    made = subprocess.run(
        [*command, str(folder / name)], capture_output=True, text=True, check=False, timeout=100
    )
    assert made.returncode == 0, f"the firmware does not compile:\n{made.stderr}"
    return folder / name


@functools.cache
def _can_sanitize() -> bool:
    command = ["cc", f"-fsanitize={SANITIZERS}", "-x", "c", "-o", "/dev/null", "-"]
    tried = subprocess.run(command, input=b"int main(void){return 0;}", capture_output=True, check=False)
    return tried.returncode == 0
