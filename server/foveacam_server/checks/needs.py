"""Requirements of a rig on its machine, which determine the severity of a finding."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from foveacam_hardware.camera_config import (
    ROLES,
    MachineVisionCameraConfig,
    OpenCvCameraConfig,
)
from foveacam_hardware.rig_config import SerialRigConfig, SimulatedRigConfig

MACHINE_VISION = ("aravis", "pylon")


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedCamera:
    """A camera of the rig file; `wanted`: its serial number or source."""

    role: str
    kind: str
    wanted: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RigNeeds:
    """Devices of the rig file. `ports`: serial ports by their use."""

    simulated: bool
    cameras: tuple[NamedCamera, ...] = ()
    ports: Mapping[str, str] = field(default_factory=dict)

    @property
    def kinds(self) -> set[str]:
        """The camera drivers that the rig uses."""
        return {camera.kind for camera in self.cameras}

    @property
    def machine_vision(self) -> bool:
        """Whether it has cameras of high bandwidth on a network or USB bus."""
        return not self.kinds.isdisjoint(MACHINE_VISION)


def needs_of(config: SimulatedRigConfig | SerialRigConfig) -> RigNeeds:
    """Return the requirements of a rig."""
    if isinstance(config, SimulatedRigConfig):
        return RigNeeds(simulated=True)
    cameras = []
    for role in ROLES:
        camera = getattr(config.cameras, role)
        match camera:
            case MachineVisionCameraConfig():
                cameras.append(NamedCamera(role=role, kind=camera.kind, wanted=camera.serial))
            case OpenCvCameraConfig():
                cameras.append(NamedCamera(role=role, kind=camera.kind, wanted=str(camera.source)))
    ports = {"mirrors": config.mirrors.port}
    for use, device in (("pan_tilt", config.pan_tilt), ("rail", config.rail)):
        port = getattr(device, "port", None)  # a device moved by hand has none
        if port is not None:
            ports[use] = port
    return RigNeeds(simulated=False, cameras=tuple(cameras), ports=ports)
