"""Where results of studies are kept."""

import os
from pathlib import Path


def cache_folder() -> Path:
    """Return the folder of kept results (XDG base directories)."""
    root = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(root) / "foveacam" / "studies"
