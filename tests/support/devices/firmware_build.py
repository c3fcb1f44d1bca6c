"""Compiles the controller's firmware for this machine, whenever its sources have changed since."""

import fcntl
import functools
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[3] / "hardware" / "firmware"
SANITIZERS = "address,undefined"


def built(name: str, *, sanitized: bool = False) -> Path:
    """Return one of the Makefile's products; skip the test where nothing can compile."""
    missing = [tool for tool in ("make", "cc") if shutil.which(tool) is None]
    if missing:
        pytest.skip(f"no {' and no '.join(missing)} on this machine: run tests/system/install-compiler.sh")
    return _make(name, SANITIZERS if sanitized and _can_sanitize() else "")


class _Folder:
    """Where products go: beside the sources, else to a folder that goes with the process."""

    def __init__(self, name: str) -> None:
        self.path = SOURCES / "build" / name
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            writable = os.access(self.path, os.W_OK)
        except OSError:
            writable = False
        if not writable:
            self._folder = tempfile.TemporaryDirectory(prefix="fovea-firmware-")
            self.path = Path(self._folder.name)

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keep other test processes out meanwhile."""
        with (self.path / ".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield


@functools.cache
def _folder(sanitize: str) -> _Folder:
    return _Folder("tests-checked" if sanitize else "tests")


@functools.cache
def _make(name: str, sanitize: str) -> Path:
    folder = _folder(sanitize)
    product = folder.path / name
    command = ["make", "--silent", "--directory", str(SOURCES), f"OUT={folder.path}", f"SANITIZE={sanitize}"]
    with folder.alone():
        made = subprocess.run(
            [*command, str(product)], capture_output=True, text=True, check=False, timeout=100
        )
    assert made.returncode == 0, f"the firmware does not compile:\n{made.stderr}"
    return product


@functools.cache
def _can_sanitize() -> bool:
    command = ["cc", f"-fsanitize={SANITIZERS}", "-x", "c", "-o", "/dev/null", "-"]
    tried = subprocess.run(command, input=b"int main(void){return 0;}", capture_output=True, check=False)
    return tried.returncode == 0
