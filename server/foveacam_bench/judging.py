"""What several benches share: a simulated rig's truth, statistics, the peak memory of a process."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, DeviceFault
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.truth import Truth


def truth_of(rig: Rig) -> Truth:
    """Return the truth of a simulated rig; raise `DeviceFault` for a rig without one."""
    if rig.truth is None:
        raise DeviceFault(f"rig {rig.rig_id} has no truth; open a simulated rig with open_simulated")
    return rig.truth


def bin_cameras(rig: Rig, binning: Binning) -> None:
    """Switch all cameras of a rig to a binning."""
    for camera in (rig.wide, rig.left, rig.right):
        camera.configure(replace(camera.settings, binning=binning))


def rms(values: NDArray[np.float64]) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def percentile(values: Sequence[float], share: float) -> float:
    """Return the value that this share of the values does not exceed; 0 for no values."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else 0.0


def peak_memory_kib(pid: int | None = None) -> int:
    """Return the largest resident memory that a process (None: this one) has had, KiB."""
    lines = Path(f"/proc/{'self' if pid is None else pid}/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))
