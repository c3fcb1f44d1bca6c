"""Makes one reference over long baselines in a process of its own: `python -m` this module.

It may be killed at any time: the dataset then has the reference that it had before.
"""

import json
import sys
from dataclasses import dataclass
from pathlib import Path

from foveacam_server.capturing.child_work import StdoutProgress, work

COSTS = {"depth of the pairs": 2.0, "views from other places": 3.0, "matching over long baselines": 3.0}
"""What one pair's step takes, to each other; measured at full resolution over three stops."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceSpec:
    """Which reference is asked for. `scan`: whose depth is judged; None: of the stop nearest to the middle.

    `bracket`: which exposure. `across`: samples over the width of a view. `rail_sigma_m`: standard error of
    a place on the rail.
    """

    scan: int | None = None
    bracket: int = 0
    across: int = 10
    rail_sigma_m: float = 1e-4


def make(dataset: Path, wish: ReferenceSpec) -> None:
    """Make the reference of a dataset and put it beside its frames."""
    from foveacam_pipeline.capture.dataset import Dataset
    from foveacam_pipeline.capture.rail_stops import reference_basis
    from foveacam_pipeline.capture.reference import (
        RailTrust,
        ReferenceSettings,
        build_reference,
        write_reference,
    )

    opened = Dataset.open(dataset)
    rail = RailTrust(along_m=wish.rail_sigma_m)
    settings = ReferenceSettings(scan=wish.scan, bracket=wish.bracket, across=wish.across, rail=rail)
    pairs = reference_basis(opened, scan=wish.scan, bracket=wish.bracket).pairs
    write_reference(dataset, build_reference(opened, settings, watch=StdoutProgress(pairs, COSTS)))


def main() -> int:
    """Do what the arguments say: dataset, wish as JSON. Return 0, or 1 when it was told why not."""
    dataset, wish = sys.argv[1:]
    return work(lambda: make(Path(dataset), ReferenceSpec(**json.loads(wish))))


if __name__ == "__main__":
    sys.exit(main())
