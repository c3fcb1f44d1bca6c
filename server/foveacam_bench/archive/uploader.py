"""A process that forks an uploader for each line that it reads, so that each can be killed at once.

It has no threads and has the storage's packages loaded. A line names the archive and the dataset's folder; it
prints the uploader's process id, and the exit status once it has ended.
"""

import os
import sys

import s3fs

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.capture.archiving import dataset_item
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.storage.archive import upload_item

UTC = "2026-01-01T00:00:00+00:00"
CUT = 3
"""Exit status of an uploader whose storage went away."""


def serve() -> None:
    """Fork an uploader for each line of stdin."""
    s3fs.S3FileSystem.retries = 1  # storage that is gone stays gone here
    for line in sys.stdin:
        url, folder = line.rstrip("\n").split("\t")
        child = os.fork()
        if child == 0:
            os._exit(_upload(url, folder))
        print(child, flush=True)  # noqa: T201 - the answer
        _, status = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)  # noqa: T201 - the answer


def _upload(url: str, folder: str) -> int:
    item = dataset_item(Dataset.open(folder), item_id="bench")
    try:
        upload_item(url, item, utc=UTC, watch=lambda done, total: None)
    except FoveaError:
        return CUT
    return 0


if __name__ == "__main__":
    serve()
