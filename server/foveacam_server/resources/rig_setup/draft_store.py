"""The draft in the making, in a file that outlives a restart: its values, and the rig file it began from."""

import logging
from pathlib import Path

from foveacam_server.foundation.schema import RequestModel
from foveacam_server.foundation.whole_file import read_document, write_document
from foveacam_server.resources.rig_setup.schema import RigDraft

_log = logging.getLogger(__name__)
FILE, FORM, VERSION = "draft.json", "foveacam-rig-draft", 1


class StoredDraft(RequestModel):
    """A draft; `path`, `text`: the rig file that it began from, as it was then; null: a new file."""

    draft: RigDraft = RigDraft()
    path: str | None = None
    text: str | None = None


def load_draft(folder: Path) -> StoredDraft | None:
    """Return the stored draft; None without a readable one."""
    try:
        return read_document(folder / FILE, StoredDraft, form=FORM, version=VERSION)
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        _log.warning("the draft of a rig begins anew: %s cannot be read (%s)", FILE, error)
        return None


def store_draft(folder: Path, stored: StoredDraft) -> None:
    """Write a draft; raise as `write_whole`."""
    document = {"format": FORM, "version": VERSION, **stored.as_json()}
    write_document(folder / FILE, document, what="the draft of the rig")
