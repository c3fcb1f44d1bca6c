"""Mistakes in the assembly of a simulated rig: their schema in a rig file."""

from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

from foveacam_hardware.contract import Role
from foveacam_hardware.simulated_faults import CameraName

Share: TypeAlias = Annotated[float, Field(ge=0.0, le=0.9)]
AxisName: TypeAlias = Literal["x", "y"]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class CameraAssembly(_Table):
    """Mistakes in one camera; none by default."""

    mirrored: bool = False
    """The picture is reversed from left to right."""
    upside_down: bool = False
    """The picture is rotated by 180 degrees."""
    defocus_px: Annotated[float, Field(ge=0.0, le=4.0)] = 0.0
    """Sigma of a Gaussian blur in addition to the lens's, pixels of the sensor."""
    transmission: Annotated[float, Field(gt=0.05, le=1.0)] = 1.0
    """Share of the light that the lens passes."""
    vignetting: Share = 0.0
    """Share of the light that is lost in the corners."""
    hot_fraction: Annotated[float, Field(ge=0.0, le=0.01)] = 0.0
    """Share of the pixels that are white whatever the light."""
    black_level: Annotated[float, Field(ge=-32.0, le=32.0)] = 0.0
    """Offset of the picture in addition to the camera's setting, grey levels of 8 bits."""
    lost_bits: Annotated[int, Field(ge=0, le=6)] = 0
    """Number of lowest bits that are always 0, as in a picture of another pixel format."""
    bayer_as_grey: bool = False
    """The mosaic of a colour sensor arrives as if it were the picture."""
    noise: Annotated[float, Field(ge=0.0, le=32.0)] = 0.0
    """Standard deviation of noise in addition to the sensor's, grey levels of 8 bits."""
    lost_frames: Annotated[float, Field(ge=0.0, le=0.5)] = 0.0
    """Share of the frames that never arrive."""


class FoveaAssembly(CameraAssembly):
    """Mistakes in one fovea: its camera, its mirror and its mount; none by default."""

    exchanged_axes: bool = False
    """The leads of the mirror's x and y axes are exchanged."""
    reversed_axes: Annotated[list[AxisName], Field(max_length=2)] = []
    """Axes whose two leads are exchanged."""
    exposure_delay_us: Annotated[int, Field(ge=0, le=4000)] = 0
    """Delay of exposure and strobe that is left in the camera's settings."""
    strobe_delay_us: Annotated[int, Field(ge=0, le=1500)] = 0
    """Delay of the strobe against the exposure."""
    loose_mount_deg: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """Standard deviation of the mount's turns, which change several times a second."""
    mount_drift_deg_per_min: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """Steady turn of the mount to the right."""


class SimulatedAssembly(_Table):
    """Mistakes in a simulated rig's assembly; none by default."""

    exchanged_cameras: Annotated[list[CameraName], Field(max_length=2)] = []
    """Two cameras whose cables are exchanged."""
    exchanged_mirrors: bool = False
    """The left mirror is driven by the outputs of the right one, and vice versa."""
    drive_scale: Annotated[float, Field(ge=0.5, le=1.0)] = 1.0
    """Volts at the mirrors as a share of the commanded ones: a high-voltage supply that sags."""
    filter_scale: Annotated[float, Field(ge=0.25, le=1.0)] = 1.0
    """Cut-off of the drive filters as a share of the one that is set."""
    baseline_scale: Annotated[float, Field(ge=0.9, le=1.1)] = 1.0
    """Distance between the mirrors as a share of the calibrated one."""
    controller_clock_ppm: Annotated[float, Field(ge=-2000.0, le=2000.0)] = 0.0
    """How much faster the controller's clock runs."""
    wide: CameraAssembly = CameraAssembly()
    left: FoveaAssembly = FoveaAssembly()
    right: FoveaAssembly = FoveaAssembly()

    def camera(self, role: Role) -> CameraAssembly:
        """Return the table of a camera."""
        return {Role.WIDE: self.wide, Role.LEFT: self.left, Role.RIGHT: self.right}[role]

    def eye(self, role: Role) -> FoveaAssembly:
        """Return the table of the left or right fovea."""
        return self.left if role is Role.LEFT else self.right

    def optics_of(self, role: Role) -> Role:
        """Return the camera whose lens forms the pictures that arrive as a role's."""
        names = [Role(name) for name in self.exchanged_cameras]
        if len(names) == 2 and role in names:
            return names[1 - names.index(role)]
        return role
