"""The name, label and licence of a dataset: the rule for names, and later changes of label and licence."""

import re
import unicodedata
from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset.document import DatasetDocument, read_document, write_document
from foveacam_pipeline.capture.dataset.lock import FolderLock
from foveacam_pipeline.storage.disk import disk_errors

LONGEST_LABEL = 2000
"""Longest label or licence, characters."""
LONGEST_NAME = 100
"""Longest name of a dataset, characters."""
LONGEST_NAME_BYTES = 200
"""Longest name in UTF-8, bytes: file systems allow 255, and temporary files add to it."""

_FORBIDDEN = set('/\\:*?"<>|')
_UNSEEN = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\U000e0100-\U000e01ef]"
)
"""Fillers, joiners and variation selectors: invisible, although Unicode counts them as letters or marks."""
_RESERVED = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|com[0-9¹²³]|lpt[0-9¹²³])(\..*)?", re.IGNORECASE)


def change_labels(
    path: str | Path, *, label: str | None = None, licence: str | None = None
) -> DatasetDocument:
    """Change the label or the licence; raise Busy while the dataset is being written."""
    folder = Path(path)
    read_document(folder)
    with disk_errors("its description", folder):
        lock = FolderLock(folder)
        try:
            document = read_document(folder).with_description(
                label=_checked(label), licence=_checked(licence)
            )
            write_document(folder, document)
        finally:
            lock.release()
    return document


def _checked(text: str | None) -> str | None:
    if text is not None and len(text) > LONGEST_LABEL:
        raise InvalidInput(
            f"a label or licence of {len(text)} characters: {LONGEST_LABEL} are kept; shorten it"
        )
    return text


def dataset_name(text: str) -> str:
    """Return `text` as a valid name in NFC; raise InvalidInput that says why it is not valid."""
    name = unicodedata.normalize("NFC", text)
    problem = _name_problem(name)
    if problem is not None:
        shown = text if len(text) <= 40 else f"{text[:40]}…"
        raise InvalidInput(
            f"name {shown!a}: {problem}; use up to {LONGEST_NAME} letters,"
            " digits, spaces, dots, dashes and underscores",
            asked="a name that every file system can hold",
            found=problem,
        )
    return name


def _name_problem(name: str) -> str | None:
    """Return the problem of a name in NFC, as text; None when it is valid."""
    checks = (
        (not name, "it is empty"),
        (len(name) > LONGEST_NAME, f"it has {len(name)} characters"),
        (
            len(name.encode("utf-8", "replace")) > LONGEST_NAME_BYTES,
            f"it is longer than {LONGEST_NAME_BYTES} bytes",
        ),
        (name != name.strip() or name.endswith("."), "it begins or ends with a space, or ends with a dot"),
        (name.startswith((".", "-")), "it begins with a dot or a dash"),
        (_RESERVED.fullmatch(name) is not None, "Windows keeps that name for a device"),
    )
    return next((why for bad, why in checks if bad), None) or _bad_character(name)


def _bad_character(name: str) -> str | None:
    for character in name:
        category = unicodedata.category(character)
        if character in _FORBIDDEN or _FORBIDDEN & set(unicodedata.normalize("NFKC", character)):
            return f"it contains {character!r}, which separates folders or means something to a shell"
        unseen = category[0] == "C" or (category[0] == "Z" and character != " ")
        if unseen or _UNSEEN.fullmatch(character):
            return f"it contains U+{ord(character):04X}, which cannot be seen"
    return None
