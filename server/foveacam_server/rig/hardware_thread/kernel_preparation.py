"""Compiles the kernels of a simulated rig in child processes beside each other, then loads them here.

Their memory goes with the children. Where a child fails, or nothing can be stored, this process compiles.
"""

import logging
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

from foveacam_hardware.contract import Cancelled, FoveaError
from foveacam_server.foundation.child_process import OnProgress, run_child
from foveacam_server.foundation.child_work import ChildProgress
from foveacam_server.foundation.collection_pause import collection_paused

_log = logging.getLogger(__name__)

WORKER = "foveacam_server.rig.hardware_thread.kernel_worker"
SHARES: tuple[tuple[str, ...], ...] = (("tiles",), ("set-up", "faces of tiles", "lens", "sensor"))
"""Which kernels each child compiles; the two take about as long."""
NOTICED_S = 1.0
"""From such a time on, the time left is estimated."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelProgress:
    """How many kernels are compiled; `left_s`: time left, None while it is not known."""

    done: int
    total: int
    left_s: float | None

    def __str__(self) -> str:
        return f"{self.done} of {self.total} kernels"


OnKernels = Callable[[KernelProgress], None]


class ChildRunner(Protocol):
    """Runs a module in a child process, as `child_process.run_child`."""

    def __call__(
        self,
        module: str,
        arguments: Sequence[str],
        *,
        on_progress: OnProgress,
        cancelled: Callable[[], bool],
    ) -> None:
        """Run it to its end."""
        ...


def kernels_stored() -> bool:
    """Return whether the kernels of the simulated rig were compiled before and need only be loaded."""
    with collection_paused():
        from foveacam_hardware.jit import is_cached
        from foveacam_hardware.sim.render.compilation import kernel_steps

    return all(is_cached(step.kernel) for step in kernel_steps())


def kernels_storable() -> str | None:
    """Return why compiled kernels cannot be stored; None where they can."""
    from foveacam_hardware.jit import cache_trouble
    from foveacam_hardware.sim.render.compilation import kernel_steps

    return next((why for step in kernel_steps() if (why := cache_trouble(step.kernel)) is not None), None)


def load_kernels() -> None:
    """Load the kernels, or compile those that are not stored."""
    from foveacam_hardware.sim.render import warm_up

    warm_up()


def compile_in_children(
    *,
    on_progress: OnKernels,
    cancelled: Callable[[], bool],
    run: ChildRunner = run_child,
    shares: Sequence[Sequence[str]] = SHARES,
    now_s: Callable[[], float] = time.monotonic,
) -> None:
    """Compile all kernels in one child process a share; raise the first error of a child.

    Raise `Cancelled` soon after `cancelled` says so. When one child fails, the others are ended.
    """
    watch = _SharedProgress(len(shares), on_progress, now_s=now_s)
    failed = threading.Event()

    def compile_share(index: int) -> None:
        try:
            run(
                WORKER,
                shares[index],
                on_progress=lambda step: watch.take(index, step),
                cancelled=lambda: failed.is_set() or cancelled(),
            )
        except BaseException:
            failed.set()
            raise

    with ThreadPoolExecutor(len(shares), "foveacam-kernels") as pool:
        ends = [pool.submit(compile_share, index) for index in range(len(shares))]
    errors = [error for end in ends if (error := end.exception()) is not None]
    if errors:
        raise next((error for error in errors if not isinstance(error, Cancelled)), errors[0])


class _SharedProgress:
    """Adds up what the children report; their threads call it."""

    def __init__(self, children: int, on_progress: OnKernels, *, now_s: Callable[[], float]) -> None:
        self._newest: dict[int, ChildProgress] = {}
        self._children, self._on_progress, self._now_s = children, on_progress, now_s
        self._began_s: float | None = None
        self._lock = threading.Lock()

    def take(self, index: int, step: ChildProgress) -> None:
        """Take what a child reports, and report the sum once all have begun."""
        with self._lock:
            if self._began_s is None:
                self._began_s = self._now_s()
            self._newest[index] = step
            if len(self._newest) < self._children:
                return
            steps, spent_s = tuple(self._newest.values()), self._now_s() - self._began_s
            self._on_progress(
                KernelProgress(
                    done=sum(step.done for step in steps),
                    total=sum(step.total for step in steps),
                    left_s=_left_s(min(step.share for step in steps), spent_s),
                )
            )


def _left_s(share: float, spent_s: float) -> float | None:
    """Return the time left when a share of the work took `spent_s`."""
    return None if spent_s < NOTICED_S or share <= 0.0 else spent_s * (1.0 - share) / share


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelTools:
    """What a preparation consists of; a test replaces them."""

    stored: Callable[[], bool] = kernels_stored
    trouble: Callable[[], str | None] = kernels_storable
    load: Callable[[], None] = load_kernels
    compile: Callable[..., None] = compile_in_children


KERNEL_TOOLS = KernelTools()


def prepare_kernels(
    on_progress: OnKernels, *, cancelled: Callable[[], bool], tools: KernelTools = KERNEL_TOOLS
) -> str | None:
    """Make the kernels of a simulated rig ready before its first frame.

    Return why this process compiled them by itself; None where it had not to. Raise `Cancelled` soon after
    `cancelled` says so, unless this process compiles.
    """
    why = None if tools.stored() else tools.trouble() or _compile(on_progress, cancelled, tools)
    if why is not None:
        _log.warning("the server compiles the kernels of the simulated rig by itself: %s", why)
    tools.load()
    return why


def _compile(on_progress: OnKernels, cancelled: Callable[[], bool], tools: KernelTools) -> str | None:
    """Compile in children; return why they could not."""
    try:
        tools.compile(on_progress=on_progress, cancelled=cancelled)
    except Cancelled:
        raise
    except (FoveaError, OSError, RuntimeError, ValueError) as error:  # ValueError: no message of ours
        return str(error)
    return None
