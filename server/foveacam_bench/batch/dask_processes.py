"""A Dask scheduler and workers as processes of this machine, which can be killed."""

import os
import subprocess
import sys
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from foveacam_bench.servers import free_port
from foveacam_hardware.contract import DeviceFault, NotConnected
from foveacam_pipeline.workers.cluster import cluster_client

START_S = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusterCpu:
    """Processor time since they began of the scheduler and of each worker, s."""

    scheduler: float
    workers: tuple[float, ...]


class DaskProcesses:
    """A scheduler with workers of one thread each; they end with the context."""

    def __init__(self, folder: Path, *, workers: int) -> None:
        """`folder`: for their logs and what they store."""
        port = free_port()
        self.address = f"tcp://127.0.0.1:{port}"
        self._folder, self._count = folder, workers
        self._port = port
        self._stack = ExitStack()
        self._workers: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Self:
        with self._stack as stack:
            self._scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", str(self._port))
            self.resize(self._count)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def resize(self, workers: int) -> None:
        """Start or end workers until this many run, and wait for them."""
        while len(self._workers) > workers:
            _end(self._workers.pop())
        while len(self._workers) < workers:
            self._add_worker()
        end_s = time.monotonic() + START_S
        while self._connected() != workers:
            if time.monotonic() > end_s:
                raise DeviceFault(f"the bench's Dask cluster did not start within {START_S:g} s")
            time.sleep(0.2)

    def cpu_s(self) -> ClusterCpu:
        """Return the processor time of the scheduler and of the present workers."""
        return ClusterCpu(scheduler=_cpu_s(self._scheduler), workers=tuple(map(_cpu_s, self._workers)))

    def kill_worker(self, number: int) -> None:
        """Kill a worker without warning, and start another one."""
        _end(self._workers.pop(number))
        self._add_worker()

    def _add_worker(self) -> None:
        self._workers.append(self._start("worker", self.address, "--nthreads", "1", "--no-nanny"))

    def _start(self, *arguments: str) -> subprocess.Popen[bytes]:
        log = self._stack.enter_context((self._folder / f"dask-{time.monotonic_ns()}.log").open("wb"))
        stored: tuple[str, ...] = ("--local-directory", str(self._folder), "--death-timeout", "60")
        if arguments[0] == "scheduler":
            stored = ("--idle-timeout", "600")  # they end by themselves after a bench that was killed
        process = subprocess.Popen(  # noqa: S603 - Dask's own program
            [sys.executable, "-m", "dask", *arguments, "--no-dashboard", *stored],
            stdout=log,
            stderr=subprocess.STDOUT,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )
        self._stack.callback(_end, process)
        return process

    def _connected(self) -> int:
        try:
            with cluster_client(self.address) as client:
                return len(client.scheduler_info(n_workers=-1)["workers"])
        except NotConnected:
            return 0


def _cpu_s(process: subprocess.Popen[bytes]) -> float:
    """Return the processor time of a process, user's and system's."""
    stat = Path(f"/proc/{process.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")


def _end(process: subprocess.Popen[bytes]) -> None:
    """Kill a process without warning."""
    process.kill()
    process.wait()
