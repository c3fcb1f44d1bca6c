"""Compiles the kernels of a simulated rig in parallel child processes, then loads them here.

The memory of compilation is freed with the children. If a child fails, or nothing can be stored, this process
compiles.
"""

import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

from foveacam_hardware.contract import Cancelled, FoveaError
from foveacam_server.foundation.child_process import OnProgress, run_child
from foveacam_server.foundation.child_work import ChildProgress
from foveacam_server.foundation.gc_pause import gc_paused

_log = logging.getLogger(__name__)

WORKER = "foveacam_server.rig.hardware_thread.kernel_worker"
Phase = Sequence[Sequence[str]]
"""Phase of compilation: names of steps, one sequence for each parallel child."""
PHASES: tuple[Phase, ...] = (
    (("shading",), ("visibility", "edges", "samples", "lens")),
    (("tiles", "sensor"), ("set-up", "faces of tiles", "motion", "hiding")),
)
"""The parts of the largest kernel come first, so that both children are busy; kernels that need them come
next."""
COSTS: Mapping[str, float] = {
    "shading": 13.6,
    "visibility": 3.5,
    "edges": 3.1,
    "samples": 1.4,
    "lens": 3.4,
    "tiles": 7.0,
    "sensor": 2.5,
    "set-up": 5.0,
    "faces of tiles": 2.5,
    "motion": 2.4,
    "hiding": 0.8,
}
"""CPU time of each step, s; their ratios give the time left."""
NOTICED_S = 1.0
"""Time after which the time left is estimated."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelProgress:
    """Number of compiled kernels; `left_s`: time left, None while unknown."""

    done: int
    total: int
    left_s: float | None

    def __str__(self) -> str:
        return f"{self.done} of {self.total} kernels"


OnKernels = Callable[[KernelProgress], None]


class Preparation(Protocol):
    """Makes the kernels of a simulated rig ready; returns a problem that was not fatal, if any."""

    def __call__(self, on_progress: OnKernels, *, cancelled: Callable[[], bool]) -> str | None:
        """Return when they are ready, or raise `Cancelled`."""
        ...


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
        """Run the module to its end."""
        ...


def kernels_stored() -> bool:
    """Return whether the kernels of the simulated rig are in the cache and need only be loaded."""
    with gc_paused(keep=False):  # other servers of this process may exist
        from foveacam_hardware.simulation_kernels import are_stored

    return are_stored()


def storing_trouble() -> str | None:
    """Return why compiled kernels cannot be stored; None where they can."""
    from foveacam_hardware.simulation_kernels import storing_trouble as trouble

    return trouble()


def load_kernels() -> None:
    """Load the kernels, or compile those that are not stored."""
    from foveacam_hardware.simulation_kernels import warm_up

    warm_up()


def count_kernels() -> int:
    """Return how many functions of the renderer are compiled."""
    from foveacam_hardware.simulation_kernels import count_kernels as count

    return count()


def compile_in_children(
    *,
    on_progress: OnKernels,
    cancelled: Callable[[], bool],
    run: ChildRunner = run_child,
    phases: Sequence[Phase] = PHASES,
    total: Callable[[], int] = count_kernels,
    now_s: Callable[[], float] = time.monotonic,
) -> None:
    """Compile all kernels in child processes, phase after phase; raise the first error of a child.

    Raise `Cancelled` soon after `cancelled` returns true. When one child fails, the others are ended.
    """
    progress = _Progress(phases, total=total(), now_s=now_s)
    for phase in phases:
        _run_phase(
            phase, on_step=lambda step: on_progress(progress.after(step)), cancelled=cancelled, run=run
        )


def _run_phase(phase: Phase, *, on_step: OnProgress, cancelled: Callable[[], bool], run: ChildRunner) -> None:
    failed, reporting = threading.Event(), threading.Lock()

    def report_one(step: ChildProgress) -> None:
        with reporting:  # one child at a time
            on_step(step)

    def compile_share(names: Sequence[str]) -> None:
        try:
            run(WORKER, names, on_progress=report_one, cancelled=lambda: failed.is_set() or cancelled())
        except BaseException:
            failed.set()
            raise

    with ThreadPoolExecutor(len(phase), "foveacam-kernels") as pool:
        ends = [pool.submit(compile_share, names) for names in phase]
    errors = [error for end in ends if (error := end.exception()) is not None]
    if errors:
        raise next((error for error in errors if not isinstance(error, Cancelled)), errors[0])


class _Progress:
    """Sums the children's reports: `note`, the step; `done`, its compiled kernels; `share`, of it."""

    def __init__(self, phases: Sequence[Phase], *, total: int, now_s: Callable[[], float]) -> None:
        self._phases, self._total, self._now_s = phases, total, now_s
        self._steps: dict[str, ChildProgress] = {}
        self._began_s = now_s()

    def after(self, step: ChildProgress) -> KernelProgress:
        """Return the total progress after a child's report."""
        self._steps[step.note] = step
        done = min(self._total, sum(each.done for each in self._steps.values()))
        return KernelProgress(done=done, total=self._total, left_s=self._left_s())

    def _left_s(self) -> float | None:
        """Return the time left, from the costs of the steps on the critical path."""
        spent_s = self._now_s() - self._began_s
        whole, left = self._longest(lambda _name: 1.0), self._longest(self._rest)
        return None if spent_s < NOTICED_S or left >= whole else spent_s * left / (whole - left)

    def _longest(self, rest: Callable[[str], float]) -> float:
        """Return the cost of the critical path: of the child with most work, summed over all phases."""
        return sum(
            max(sum(COSTS[name] * rest(name) for name in share) for share in phase) for phase in self._phases
        )

    def _rest(self, name: str) -> float:
        return 1.0 - (self._steps[name].share if name in self._steps else 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelTools:
    """Functions that a preparation calls; tests replace them."""

    stored: Callable[[], bool] = kernels_stored
    trouble: Callable[[], str | None] = storing_trouble
    load: Callable[[], None] = load_kernels
    compile: Callable[..., None] = compile_in_children


KERNEL_TOOLS = KernelTools()


def prepare_kernels(
    on_progress: OnKernels, *, cancelled: Callable[[], bool], tools: KernelTools = KERNEL_TOOLS
) -> str | None:
    """Make the kernels of a simulated rig ready before its first frame.

    Return why this process compiled them itself; None where it did not. Raise `Cancelled` soon after
    `cancelled` returns true, unless this process compiles.
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
    except (FoveaError, OSError, RuntimeError, ValueError) as error:  # ValueError: malformed message
        return str(error)
    return None
