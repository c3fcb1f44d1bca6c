"""Names of datasets: one rule, that holds on every file system and hides nothing from a reader's eye."""

import re
import unicodedata

from foveacam_hardware.contract import InvalidInput

LONGEST = 100
"""Characters of a name."""
LONGEST_BYTES = 200
"""Bytes of a name in UTF-8: file systems allow 255, and temporary files add to it."""

_FORBIDDEN = set('/\\:*?"<>|')
_UNSEEN = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\U000e0100-\U000e01ef]"
)
"""Fillers, joiners and variation selectors: letters and marks by their category, and nothing to the eye."""
_RESERVED = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|com[0-9¹²³]|lpt[0-9¹²³])(\..*)?", re.IGNORECASE)


def dataset_name(text: str) -> str:
    """Return `text` as a name, its accents composed (NFC), or raise InvalidInput saying why it is none."""
    name = unicodedata.normalize("NFC", text)
    trouble = _trouble(name)
    if trouble is not None:
        shown = text if len(text) <= 40 else f"{text[:40]}…"
        raise InvalidInput(
            f"name {shown!a}: {trouble}; use up to {LONGEST} letters,"
            " digits, spaces, dots, dashes and underscores",
            asked="a name that every file system can hold",
            found=trouble,
        )
    return name


def _trouble(name: str) -> str | None:
    """Return what is wrong with a name in NFC; None when nothing is."""
    checks = (
        (not name, "it is empty"),
        (len(name) > LONGEST, f"it has {len(name)} characters"),
        (len(name.encode("utf-8", "replace")) > LONGEST_BYTES, f"it is longer than {LONGEST_BYTES} bytes"),
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
