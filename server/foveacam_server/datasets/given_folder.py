"""Finds the dataset given to a command, by its folder or by its name in the data folder."""

from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.settings import checked_settings

DATASETS = "captures"
"""Folder of datasets in the data folder."""
STILLS = "stills"
"""Folder of stills, datasets of one point, in the data folder."""


def dataset_folder(text: str, data: Path | None) -> Path:
    """Return the folder of a dataset given by path or by name, unopened."""
    path = Path(text)
    if path.exists() or len(path.parts) != 1:
        return path
    home = checked_settings({"data": data}).data
    kept = home / DATASETS / text
    if not kept.exists() and (home / STILLS / text).exists():
        return home / STILLS / text
    if not kept.exists():
        raise InvalidInput(
            f"there is no dataset {text!r}, neither here nor in {kept.parent}; give its folder"
        )
    return kept
