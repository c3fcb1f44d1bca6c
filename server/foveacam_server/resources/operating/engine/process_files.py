"""Reads CPU times of threads, memory, open files and start time of this process from Linux' `/proc`."""

import os
import resource
from collections.abc import Mapping

from foveacam_server.checks.machine import Machine

_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_USER, _SYSTEM, _BEGIN = 11, 12, 19
"""Fields of `stat` after the name in brackets (man 5 proc: 14, 15 and 22)."""


class ProcessFiles:
    """Figures of this process in `/proc`; None where there is no such file."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine

    def cpu_s(self) -> Mapping[int, float]:
        """Return the CPU time of each thread by its number; empty without `/proc`."""
        found = {}
        for file in self._machine.all("/proc/self/task/[0-9]*/stat"):
            text = self._machine.text(file)
            if text is not None:  # otherwise the thread has ended
                fields = _fields(text)
                found[int(file.parent.name)] = (int(fields[_USER]) + int(fields[_SYSTEM])) / _TICKS_PER_S
        return found

    def age_s(self) -> float | None:
        """Return the time since the process began."""
        stat, up = self._machine.text("/proc/self/stat"), self._machine.text("/proc/uptime")
        if stat is None or up is None:
            return None
        return float(up.split()[0]) - int(_fields(stat)[_BEGIN]) / _TICKS_PER_S

    def memory_mb(self) -> float | None:
        """Return the memory in use."""
        for line in (self._machine.text("/proc/self/status") or "").splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) / 1024
        return None

    def open_files(self) -> int | None:
        """Return the number of open files and connections."""
        return len(self._machine.all("/proc/self/fd/[0-9]*")) or None

    @staticmethod
    def open_files_limit() -> int:
        """Return the limit of open files."""
        return resource.getrlimit(resource.RLIMIT_NOFILE)[0]


def _fields(stat: str) -> list[str]:
    return stat.rpartition(")")[2].split()
