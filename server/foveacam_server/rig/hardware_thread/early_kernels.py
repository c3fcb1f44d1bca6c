"""Prepares the kernels of a simulated rig while the server's modules are imported, before there is a rig."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from types import TracebackType
from typing import Self

from foveacam_server.foundation.settings import Settings
from foveacam_server.rig.hardware_thread.kernel_preparation import (
    KernelProgress,
    OnKernels,
    Preparation,
    prepare_kernels,
)

LOOK_S = 0.1
"""Interval between two checks for cancellation, while it prepares."""


@contextmanager
def kernels_of(settings: Settings) -> Iterator[Preparation]:
    """Start the preparation now where the settings choose the simulated rig; otherwise when one opens."""
    if settings.rig != "sim" or settings.replay is not None:
        yield prepare_kernels
        return
    with EarlyKernels() as early:
        yield early


class EarlyKernels:
    """Prepares the kernels on a thread; implements `Preparation`, whose caller waits for it."""

    def __init__(self, prepare: Preparation = prepare_kernels) -> None:
        self._prepare = prepare
        self._ended: Future[str | None] = Future()
        self._cancelled = threading.Event()
        self._changed = threading.Condition()
        self._newest: KernelProgress | None = None
        self._thread = threading.Thread(target=self._run, name="foveacam-early-kernels", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._cancelled.set()

    def __call__(self, on_progress: OnKernels, *, cancelled: Callable[[], bool]) -> str | None:
        """Wait until the kernels are ready; return and raise as `prepare_kernels`."""
        reported: KernelProgress | None = None
        while not self._ended.done():
            if cancelled():
                self._cancelled.set()
            with self._changed:
                self._changed.wait_for(self._ended.done, LOOK_S)
                newest = self._newest
            if newest is not None and newest is not reported:
                on_progress(newest)
                reported = newest
        return self._ended.result()

    def _run(self) -> None:
        try:
            result = self._prepare(self._take, cancelled=self._cancelled.is_set)
        except BaseException as error:  # noqa: BLE001 - who waits for it raises it
            self._ended.set_exception(error)
        else:
            self._ended.set_result(result)
        with self._changed:
            self._changed.notify_all()

    def _take(self, progress: KernelProgress) -> None:
        with self._changed:
            self._newest = progress
