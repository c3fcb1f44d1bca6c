"""A process that forks an uploader for each line that it reads, so that each can be killed at once.

It has no threads and has the storage's packages loaded. A line names the archive, a dataset's folder or a
file that stands for a recording, and the size of a large file's parts; it prints the uploader's process id,
and the exit status once it has ended.
"""

import os
import sys
from pathlib import Path

import s3fs

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.capture.archiving import dataset_item, recording_item
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.storage.archive import upload_item

UTC = "2026-01-01T00:00:00+00:00"
CUT = 3
"""Exit status of an uploader whose storage became unavailable."""


def serve() -> None:
    """Fork an uploader for each line of stdin."""
    s3fs.S3FileSystem.retries = 1  # unavailable storage does not come back here
    for line in sys.stdin:
        url, place, part_bytes = line.rstrip("\n").split("\t")
        child = os.fork()
        if child == 0:
            os._exit(_upload(url, Path(place), int(part_bytes)))
        print(child, flush=True)  # noqa: T201 - the answer
        _, status = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)  # noqa: T201 - the answer


def _upload(url: str, place: Path, part_bytes: int) -> int:
    if place.is_dir():
        item = dataset_item(Dataset.open(place), item_id="bench")
    else:
        item = recording_item(place, item_id="bench", label="", created_utc=UTC, beside=(), about={})
    try:
        upload_item(url, item, utc=UTC, watch=lambda done, total: None, part_bytes=part_bytes)
    except FoveaError:
        return CUT
    return 0


if __name__ == "__main__":
    serve()
