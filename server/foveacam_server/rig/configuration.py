"""The configuration of the rig that the settings name."""

from pathlib import Path

from foveacam_hardware.rig_config import SerialRigConfig, SimulatedRigConfig, load_rig_config
from foveacam_server.foundation.settings import Settings


def rig_config(settings: Settings) -> SimulatedRigConfig | SerialRigConfig:
    """Return the rig that the settings name; raise `InvalidInput` for a file that cannot be used."""
    if settings.rig == "sim":
        return SimulatedRigConfig(scene=settings.scene, preset=settings.preset)
    return load_rig_config(Path(settings.rig))
