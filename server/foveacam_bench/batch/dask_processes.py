"""A Dask scheduler and workers as processes of this machine, which can be killed."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from foveacam_bench.servers import free_port
from foveacam_hardware.contract import DeviceFault, NotConnected
from foveacam_pipeline.batches.cluster import cluster_client

START_S = 60.0


class DaskProcesses:
    """A scheduler with workers of one thread each; they end with the context."""

    def __init__(self, folder: Path, *, workers: int) -> None:
        """`folder`: for their logs and what they store."""
        port = free_port()
        self.address = f"tcp://127.0.0.1:{port}"
        self._folder, self._count = folder, workers
        self._port = port
        self._stack = ExitStack()
        self.workers: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Self:
        with self._stack as stack:
            self._start("scheduler", "--host", "127.0.0.1", "--port", str(self._port))
            for _ in range(self._count):
                self.add_worker()
            self._wait_for_workers(self._count)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def add_worker(self) -> None:
        """Start one more worker."""
        self.workers.append(self._start("worker", self.address, "--nthreads", "1", "--no-nanny"))

    def kill_worker(self, number: int) -> None:
        """Kill a worker, which can do nothing about it, and start another one."""
        killed = self.workers.pop(number)
        killed.send_signal(signal.SIGKILL)
        killed.wait()
        self.add_worker()

    def _start(self, *arguments: str) -> subprocess.Popen[bytes]:
        log = self._stack.enter_context((self._folder / f"dask-{time.monotonic_ns()}.log").open("wb"))
        stored = ("--local-directory", str(self._folder)) if arguments[0] == "worker" else ()
        process = subprocess.Popen(  # noqa: S603 - Dask's own program
            [sys.executable, "-m", "dask", *arguments, "--no-dashboard", *stored],
            stdout=log,
            stderr=subprocess.STDOUT,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )
        self._stack.callback(_end, process)
        return process

    def _wait_for_workers(self, count: int) -> None:
        end_s = time.monotonic() + START_S
        _until(end_s, lambda: self._connected() >= count)

    def _connected(self) -> int:
        try:
            with cluster_client(self.address) as client:
                return len(client.scheduler_info(n_workers=-1)["workers"])
        except NotConnected:
            return 0


def _until(end_s: float, there: Callable[[], bool]) -> None:
    while not there():
        if time.monotonic() > end_s:
            raise DeviceFault(f"the bench's Dask cluster did not start within {START_S:g} s")
        time.sleep(0.2)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
