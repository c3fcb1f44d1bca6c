"""Schemas of imported recordings: uploaded by a browser, or opened in a folder of the server's machine."""

from typing import Annotated

from pydantic import Field

from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.resources.capturing.recordings.schema import RecordingDocument

GIB = 2**30
LARGEST_BYTES = 256 * GIB
"""Largest upload: an hour and a half of three cameras at 50 MB/s."""

RecordingName = Annotated[str, Field(max_length=1000)]


class UploadRequest(RequestModel):
    """Request of an upload: the recording's name here, without a suffix, and its length."""

    name: RecordingName
    size_bytes: Annotated[int, Field(ge=0, le=10**15)]


class UploadDocument(ResponseModel):
    """An upload.

    `part_bytes`: largest part; the next one begins at `received_bytes`. `recording`: set once the file is
    complete and readable; its `state` shows whether it was cut off.
    """

    id: str
    name: str
    size_bytes: int
    received_bytes: int
    part_bytes: int
    recording: RecordingDocument | None


class OpenRequest(RequestModel):
    """A recording in a folder of the server's machine; `name`: its name here, usually its file's."""

    path: Annotated[str, Field(min_length=1, max_length=4096)]
    name: RecordingName | None = None


class FolderDocument(ResponseModel):
    """A folder from which recordings are opened. `found`: whether it is there and can be read."""

    path: str
    found: bool


class FolderFile(ResponseModel):
    """A recording in such a folder; `opened`: whether it was already added to the recordings."""

    path: str
    name: str
    size_bytes: int
    modified_utc: str
    opened: bool


class FoldersDocument(ResponseModel):
    """The folders and their recordings, newest first. `complete`: false when there are more files."""

    folders: list[FolderDocument]
    files: list[FolderFile]
    complete: bool
