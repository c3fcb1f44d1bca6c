"""Make one batch in a child process, so that live views continue: `python -m` this module.

It may be killed at any time; the next run continues from what is on the disk.
"""

import sys
from pathlib import Path

from pydantic import BaseModel

from foveacam_server.datasets.export_format import ExportFormat
from foveacam_server.foundation.child_work import StdoutProgress, run_child
from foveacam_server.resources.capturing.batches.schema import Kind


class ChildOrder(BaseModel):
    """The batch for the child process. `card`: of the network that computes depth, if any."""

    kind: Kind
    to: ExportFormat
    datasets: tuple[Path, ...]
    out: Path
    cluster: str | None
    card: Path | None


def make(order: ChildOrder) -> None:
    """Make the missing products of a batch."""
    from foveacam_pipeline.networks.card import load_network
    from foveacam_pipeline.products.task import ProductKind, ProductSettings
    from foveacam_server.resources.capturing.batches.run import BatchOrder, make_batch

    settings = ProductSettings(
        kind=ProductKind(order.kind),
        backend="sgbm" if order.card is None else load_network(order.card),
        to=order.to,
    )
    make_batch(
        BatchOrder(datasets=order.datasets, settings=settings, out=order.out, cluster=order.cluster),
        watch=StdoutProgress(0, {}),
    )


def main() -> int:
    """Run with the order as JSON; return the exit status as `run_child`."""
    order = ChildOrder.model_validate_json(sys.argv[1])
    return run_child(lambda: make(order))


if __name__ == "__main__":
    sys.exit(main())
