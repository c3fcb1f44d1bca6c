"""Child process that compiles kernels of the simulated rig into the cache on disk.

Its arguments are names of steps (`kernel_preparation.PHASES`). It reports each kernel that is compiled.
"""

import sys
from collections.abc import Callable, Sequence

from foveacam_hardware.contract import StorageFull
from foveacam_hardware.jit import cache_trouble, compiling_watched, kernels_within
from foveacam_hardware.simulation_kernels import KernelStep, steps_of
from foveacam_server.foundation.child_work import ChildProgress, report_progress, run_child


def main(names: Sequence[str]) -> int:
    """Compile the named kernels; return the exit status as `run_child`."""
    return run_child(lambda: compile_kernels(steps_of(names)))


def compile_kernels(
    steps: Sequence[KernelStep], *, report: Callable[[ChildProgress], None] = report_progress
) -> None:
    """Compile kernels one after the other; raise `StorageFull` where they cannot be stored."""
    for step in steps:
        _compile(step, report)
        if (trouble := cache_trouble(step.kernel)) is not None:
            raise StorageFull(f"compiled kernels cannot be stored: {trouble}", found=trouble)


def _compile(step: KernelStep, report: Callable[[ChildProgress], None]) -> None:
    expected, compiled = kernels_within(step.kernel), set[str]()

    def report_share(share: float | None = None) -> None:
        done, total = len(compiled), len(expected)
        report(
            ChildProgress(
                done=done, total=total, note=step.name, share=done / total if share is None else share
            )
        )

    def take(name: str) -> None:
        if name in expected and name not in compiled:
            compiled.add(name)
            report_share()

    report_share()
    with compiling_watched(take):
        step.compile()
    report_share(share=1.0)  # kernels already in the cache are not counted


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
