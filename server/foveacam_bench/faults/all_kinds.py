"""Run every kind of fault (`foveacam bench faults`): killed hosts, invalid commands, lines, cameras, disk.

Each kind is a module of this folder: it runs its sequences, adds their outcome to the shared tally, and
returns the figures that are its own.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeAlias

from foveacam_bench.faults import (
    false_positions,
    full_disk,
    gige_camera,
    kills,
    limits,
    serial_line,
    simulated_rig,
)
from foveacam_bench.faults.tally import FaultTally
from foveacam_bench.figures import Figures, Report

Figure: TypeAlias = float | int | bool
Part: TypeAlias = Callable[[FaultTally, bool], dict[str, Figure]]
"""Measures one kind of fault; the second argument asks for fewer repetitions."""


def in_parallel(*parts: Part) -> Part:
    """Return a part that runs `parts` in parallel, as each of them mostly waits."""

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
    false_positions.measure,
    in_parallel(serial_line.measure, DEVICES),
    kills.measure,
)


def run(*, quick: bool = False, report: Report = lambda progress: None) -> Figures:
    """Run every kind of fault; `quick`: fewer of each."""
    tally = FaultTally()
    figures: Figures = {}
    for number, part in enumerate(PARTS, start=1):
        report(f"part {number} of {len(PARTS)}")
        figures |= part(tally, quick)
    return figures | tally.figures()
