"""How a part of this package that is not installed is added to the Python that runs."""

import shlex
import sys


def install_command(extra: str) -> str:
    """Return the command that installs an extra, such as `pylon`, where this program looks for it."""
    return f"{shlex.quote(sys.executable)} -m pip install 'foveacam-duo[{extra}]'"
