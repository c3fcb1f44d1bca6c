"""Make one reference over long baselines in a child process: `python -m` this module.

It may be killed at any time; the dataset then keeps its former reference.
"""

import sys
from pathlib import Path

from foveacam_server.foundation.child_work import StdoutProgress, run_child
from foveacam_server.resources.capturing.references.schema import ReferenceRequest

COSTS = {"depth of the pairs": 2.0, "views from other places": 3.0, "matching over long baselines": 3.0}
"""Relative durations of a pair's steps, for the progress; measured at full resolution over three stops."""


def make(dataset: Path, request: ReferenceRequest) -> None:
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
    rail = RailTrust(along_m=request.rail_sigma_m)
    settings = ReferenceSettings(scan=request.scan, bracket=request.bracket, across=request.across, rail=rail)
    pairs = reference_basis(opened, scan=request.scan, bracket=request.bracket).pairs
    write_reference(dataset, build_reference(opened, settings, watch=StdoutProgress(pairs, COSTS)))


def main() -> int:
    """Run with the arguments dataset, request as JSON; return the exit status as `run_child`."""
    dataset, request = sys.argv[1:]
    return run_child(lambda: make(Path(dataset), ReferenceRequest.model_validate_json(request)))


if __name__ == "__main__":
    sys.exit(main())
