"""Compilation of the simulated rig's kernels: whether they are cached, and the steps that compile them.

Importing this module loads numba, which a hardware rig does not need.
"""

from collections.abc import Sequence

from foveacam_hardware.jit import cache_trouble, is_cached, kernels_within
from foveacam_hardware.sim.render.compilation import KernelStep, kernel_steps, part_steps, warm_up

__all__ = ["KernelStep", "are_stored", "count_kernels", "steps_of", "storing_trouble", "warm_up"]


def are_stored() -> bool:
    """Return whether all kernels were compiled before and need only be loaded."""
    return all(is_cached(step.kernel) for step in kernel_steps())


def storing_trouble() -> str | None:
    """Return why compiled kernels cannot be stored; None where they can."""
    return next((why for step in kernel_steps() if (why := cache_trouble(step.kernel)) is not None), None)


def count_kernels() -> int:
    """Return how many functions of the renderer are compiled."""
    return len(set[str]().union(*(kernels_within(step.kernel) for step in kernel_steps())))


def steps_of(names: Sequence[str]) -> list[KernelStep]:
    """Return the steps of such names, in their order: kernels, and parts that are stored by themselves."""
    named = {step.name: step for step in (*kernel_steps(), *part_steps())}
    return [named[name] for name in names]
