"""Figures of trouble: killed hosts, senseless commands, broken lines, and how long until all is well again.

Each part is a module `faults_…` of its own: it measures, adds what became of its sequences to the one tally,
and returns figures that are its alone.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeAlias

from foveacam_bench.faults import (
    full_disk,
    gige_camera,
    kills,
    limits,
    serial_line,
    simulated_rig,
)
from foveacam_bench.faults.tally import FaultTally

Figure: TypeAlias = float | int | bool
Part: TypeAlias = Callable[[FaultTally, bool], dict[str, Figure]]
"""Measures one kind of trouble; the second argument asks for fewer repetitions."""


def in_parallel(*parts: Part) -> Part:
    """Return a part that measures all of `parts` at the same time: they mostly wait."""

    def measure(tally: FaultTally, quick: bool) -> dict[str, Figure]:
        figures: dict[str, Figure] = {}
        with ThreadPoolExecutor(len(parts)) as pool:
            for done in [pool.submit(part, tally, quick) for part in parts]:
                figures |= done.result()
        return figures

    return measure


DEVICES = in_parallel(simulated_rig.measure, gige_camera.measure, full_disk.measure)
"""Cameras, cables and disk."""
PARTS: tuple[Part, ...] = (
    limits.measure,
    in_parallel(serial_line.measure, DEVICES),
    kills.measure,
)


def run(*, quick: bool = False) -> dict[str, Figure]:
    """Go through every kind of trouble; `quick` takes fewer of each."""
    tally = FaultTally()
    figures: dict[str, Figure] = {}
    for part in PARTS:
        figures |= part(tally, quick)
    return figures | tally.figures()
