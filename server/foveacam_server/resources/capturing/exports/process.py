"""Make one export in a child process, so that live views continue: `python -m` this module."""

import os
import sys
from pathlib import Path

from pydantic import BaseModel

from foveacam_server.datasets.download import zip_stream
from foveacam_server.foundation.child_work import ChildProgress, report_progress, run_child
from foveacam_server.resources.capturing.exports.collection import MADE, ExportRecord, write_record

PACKING_STEPS = 0.1
"""Steps of packing relative to one for each point; deduced: a copy, where a point is encoded."""


class ExportOrder(BaseModel):
    """The export for the child process. `title`: folder in the ZIP file; `out`: an empty folder."""

    dataset: Path
    out: Path
    title: str
    record: ExportRecord


class _Steps:
    """Reports the exported points, then the packed share."""

    def __init__(self, points: int) -> None:
        self._points, self._done = points, 0
        self._packing = max(1, round(points * PACKING_STEPS))

    def point(self, _index: int) -> None:
        """Report one more point."""
        self._done += 1
        self._report(self._done, "writing the points")

    def pack(self, share: float) -> None:
        """Report the share of the export that is packed."""
        self._report(self._points + int(share * self._packing), "packing the files")

    def _report(self, done: int, note: str) -> None:
        total = self._points + self._packing
        report_progress(ChildProgress(done=done, total=total, note=note, share=done / total))


def make(order: ExportOrder) -> None:
    """Export a dataset to `MADE` in the order's folder, as a ZIP file with its record."""
    from foveacam_pipeline.capture.dataset import Dataset
    from foveacam_pipeline.capture.dataset.export import ExportChoice, export_dataset
    from foveacam_pipeline.storage.disk import disk_errors

    dataset = Dataset.open(order.dataset)
    steps = _Steps(len(dataset))
    choice = ExportChoice(on_point=steps.point)
    exported = export_dataset(dataset, order.out / order.title, to=order.record.kind, choice=choice)
    made = order.out / MADE
    with disk_errors("the export", order.out):
        made.mkdir()
        _pack(exported, made / order.record.file, steps)
    write_record(made, order.record)


def _pack(folder: Path, target: Path, steps: _Steps) -> None:
    """Pack a folder durably, and remove each file once it is packed: both never need twice the space."""
    whole = max(1, sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()))
    packed = 0
    with target.open("wb") as file:
        for block in zip_stream(folder, remove=True):
            file.write(block)
            packed += len(block)
            steps.pack(min(1.0, packed / whole))
        file.flush()
        os.fsync(file.fileno())


def main() -> int:
    """Run with the order as JSON; return the exit status as `run_child`."""
    order = ExportOrder.model_validate_json(sys.argv[1])
    return run_child(lambda: make(order))


if __name__ == "__main__":
    sys.exit(main())
