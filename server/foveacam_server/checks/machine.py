"""The machine that the checks examine: its file system, the user, and the user's permissions.

Tests use another root; no check accesses the system in another way.
"""

import grp
import os
import pwd
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceHolder:
    """A process that has a device open."""

    pid: int
    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """`root` stands for `/`. `may_use`: whether the user may read and write a device file."""

    root: Path = Path("/")
    user: str = field(default_factory=lambda: pwd.getpwuid(os.getuid()).pw_name)
    may_use: Callable[[Path], bool] = field(default=lambda path: os.access(path, os.R_OK | os.W_OK))
    own_pid: int = field(default_factory=os.getpid)

    def at(self, path: str) -> Path:
        """Return the path below `root` of an absolute path of the machine."""
        return self.root / path.lstrip("/")

    def text(self, path: str | Path) -> str | None:
        """Return the text of a small file; None when it cannot be read."""
        file = self.at(path) if isinstance(path, str) else path
        try:
            return file.read_text(encoding="utf-8", errors="replace").strip()
        except OSError:
            return None

    def number(self, path: str | Path) -> int | None:
        """Return the integer in a small file; None when it has none."""
        text = self.text(path)
        return int(text) if text is not None and text.lstrip("-").isdigit() else None

    def all(self, pattern: str) -> list[Path]:
        """Return the paths that fit an absolute pattern."""
        return sorted(self.root.glob(pattern.lstrip("/")))

    def group_of(self, path: Path) -> str:
        """Return the name of the group that owns a file."""
        try:
            return grp.getgrgid(path.stat().st_gid).gr_name
        except (OSError, KeyError):
            return "dialout"

    def holders(self, device: Path) -> list[DeviceHolder]:
        """Return the other processes that have a device open, as far as this user may see."""
        target = str(device.resolve())
        holders = []
        for process in self.all("/proc/[0-9]*"):
            if int(process.name) != self.own_pid and target in self._open_files(process):
                holders.append(DeviceHolder(pid=int(process.name), name=self.text(process / "comm") or "?"))
        return holders

    def _open_files(self, process: Path) -> set[str]:
        found = set()
        try:
            for link in (process / "fd").iterdir():
                found.add(str(self._inside(str(link.readlink()))))
        except OSError:  # it has ended, or is another user's
            return found
        return found

    def _inside(self, target: str) -> Path:
        return self.at(target).resolve() if target.startswith("/") else Path(target)
