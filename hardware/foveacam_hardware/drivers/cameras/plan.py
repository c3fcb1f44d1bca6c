"""What a camera is opened with, every time."""

from dataclasses import dataclass, field

from foveacam_hardware.contract import CameraSettings
from foveacam_hardware.drivers.cameras.watchdog import WatchdogTimeouts


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraPlan:
    """Settings to begin with, the sensor's readout, and how much is waited for it and kept of it."""

    settings: CameraSettings
    readout_ns: int = 0
    """How long a frame is read out of the sensor; used where the camera's clock cannot be read."""
    frames: int = 8
    """How many wait for their reader."""
    patience: WatchdogTimeouts = field(default_factory=WatchdogTimeouts)
