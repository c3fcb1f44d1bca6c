"""Child process that compiles kernels of the simulated rig into the cache on disk.

Its arguments are names of `kernel_steps`, or `depth`. It reports each kernel that is compiled.
"""

import sys
from collections.abc import Callable, Sequence

from foveacam_hardware.contract import StorageFull
from foveacam_hardware.jit import cache_trouble, compiling_watched, kernels_within
from foveacam_hardware.sim.render.compilation import KernelStep, kernel_steps
from foveacam_server.foundation.child_work import ChildProgress, report_progress, run_child


def main(names: Sequence[str]) -> int:
    """Compile the named kernels; return the exit status as `run_child`."""
    return run_child(lambda: compile_kernels([step for step in kernel_steps() if step.name in names]))


def compile_kernels(
    steps: Sequence[KernelStep], *, report: Callable[[ChildProgress], None] = report_progress
) -> None:
    """Compile kernels one after the other; raise `StorageFull` where they cannot be stored."""
    expected = set().union(*(kernels_within(step.kernel) for step in steps))
    compiled: set[str] = set()

    def tell(name: str) -> None:
        if name not in expected or name in compiled:
            return
        compiled.add(name)
        done, total = len(compiled), len(expected)
        report(ChildProgress(done=done, total=total, note=name, share=done / total))

    report(ChildProgress(done=0, total=len(expected), note="", share=0.0))
    with compiling_watched(tell):
        for step in steps:
            step.call()
            if (trouble := cache_trouble(step.kernel)) is not None:
                raise StorageFull(f"compiled kernels cannot be stored: {trouble}", found=trouble)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
