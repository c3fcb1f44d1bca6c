"""Worker processes of this machine."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

import cv2

from foveacam_pipeline.workers.pool import AHEAD, HereAndNow, Part, PartLost, WorkPool

T = TypeVar("T")
P = ParamSpec("P")


@contextmanager
def local_workers(workers: int) -> Generator[WorkPool, None, None]:
    """Open worker processes, which end with the context and with this program; one: this process itself."""
    if workers == 1:
        yield HereAndNow()
        return
    processes = _Processes(workers)
    try:
        yield processes
    finally:
        processes.close()


class _Processes:
    def __init__(self, workers: int) -> None:
        self.most_under_way = (1 + AHEAD) * workers
        self._workers = workers
        self._executor = self._open()

    def submit(self, work: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> Part[T]:
        """Submit a part to a process; a process started for it leaves Ctrl-C to this program."""
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return self._executor.submit(work, *arguments, **named)
        except BrokenProcessPool:  # all its processes are gone: new ones compute what comes now
            self._executor = self._open()
            return self._executor.submit(work, *arguments, **named)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def result(self, part: Part[T]) -> T:
        """Wait for the result of a part."""
        try:
            return part.result()
        except BrokenProcessPool as error:
            raise PartLost(
                "a worker process was ended from outside, perhaps for its memory",
                remedy="start it again, with fewer --workers if memory is short",
            ) from error

    def close(self) -> None:
        """End the processes after the parts that have begun."""
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _open(self) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(self._workers, mp_context=context, initializer=_start_worker)


def _start_worker() -> None:
    """Use one core, and end when the program that started the worker ends, in whatever way."""
    cv2.setNumThreads(1)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
