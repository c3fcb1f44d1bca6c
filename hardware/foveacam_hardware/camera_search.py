"""Which cameras are there: every driver's own search, by the kind that a rig file names.

Beside `rig` and `rig_cameras` the module that names camera drivers. A search opens no camera, and raises
`NotConnected` where its library is missing.
"""

from collections.abc import Callable
from typing import TypeAlias

from foveacam_hardware.drivers.cameras import aravis_library, pylon_library, video_devices
from foveacam_hardware.drivers.cameras.device import FoundCamera

Discover: TypeAlias = Callable[[], list[FoundCamera]]
"""Looks for the cameras that a library sees."""


def camera_searches() -> dict[str, Discover]:
    """Return the searches by kind; none has begun."""
    return {
        "aravis": aravis_library.discover,
        "pylon": pylon_library.found_cameras,
        "opencv": video_devices.found_cameras,
    }
