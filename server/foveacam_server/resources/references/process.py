"""Make one reference over long baselines in a child process: `python -m` this module.

It may be killed at any time; the dataset then has its former reference.
"""

import json
import sys
from dataclasses import dataclass
from pathlib import Path

from foveacam_server.foundation.child_work import StdoutProgress, run_child

COSTS = {"depth of the pairs": 2.0, "views from other places": 3.0, "matching over long baselines": 3.0}
"""Relative duration of a pair's steps; measured at full resolution over three stops."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceSpec:
    """The reference to make. `scan`: whose depth is compared; None: of the stop nearest to the middle.

    `bracket`: number of the exposure. `across`: samples over the width of a view. `rail_sigma_m`: standard
    error of a rail position.
    """

    scan: int | None = None
    bracket: int = 0
    across: int = 10
    rail_sigma_m: float = 1e-4


def make(dataset: Path, spec: ReferenceSpec) -> None:
    """Make the reference of a dataset and store it in the dataset's folder."""
    from foveacam_pipeline.capture.dataset import Dataset
    from foveacam_pipeline.capture.rail_stops import reference_basis
    from foveacam_pipeline.capture.reference import (
        RailTrust,
        ReferenceSettings,
        build_reference,
        write_reference,
    )

    opened = Dataset.open(dataset)
    rail = RailTrust(along_m=spec.rail_sigma_m)
    settings = ReferenceSettings(scan=spec.scan, bracket=spec.bracket, across=spec.across, rail=rail)
    pairs = reference_basis(opened, scan=spec.scan, bracket=spec.bracket).pairs
    write_reference(dataset, build_reference(opened, settings, watch=StdoutProgress(pairs, COSTS)))


def main() -> int:
    """Run with the arguments dataset, spec as JSON; return the exit status as `run_child`."""
    dataset, spec = sys.argv[1:]
    return run_child(lambda: make(Path(dataset), ReferenceSpec(**json.loads(spec))))


if __name__ == "__main__":
    sys.exit(main())
