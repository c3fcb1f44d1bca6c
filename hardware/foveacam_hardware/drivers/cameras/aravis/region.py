"""The part of its sensor that a GenICam camera reads, and its own binning of that part, through libaravis."""

import logging
from ctypes import byref, c_int
from dataclasses import dataclass
from typing import Protocol

from foveacam_hardware.contract import Binning, CameraSettings, DeviceFault, OutOfRange
from foveacam_hardware.drivers.cameras.frame_checks import GREY

logger = logging.getLogger(__name__)

AXES = ("BinningHorizontal", "BinningVertical")
AVERAGE = "Average"
REGION = ("OffsetX", "OffsetY", "Width", "Height")


@dataclass(frozen=True, slots=True, kw_only=True)
class RegionOptions:
    """Rig file options in pixels of the sensor; None: all of it, centred."""

    width_px: int | None = None
    height_px: int | None = None
    offset_x_px: int | None = None
    offset_y_px: int | None = None


class FeatureAccess(Protocol):
    """Features and calls of an open camera that this module uses."""

    def has(self, feature: str) -> bool:
        """Return whether the camera has a feature now."""
        ...

    def text(self, feature: str) -> str:
        """Return the value of an enumeration feature."""
        ...

    def choices(self, feature: str) -> frozenset[str]:
        """Return the possible values of an enumeration feature."""
        ...

    def choose(self, feature: str, word: str) -> None:
        """Set an enumeration feature."""
        ...

    def integer(self, feature: str) -> int:
        """Return the value of a numeric feature."""
        ...

    def call(self, name: str, *arguments: object) -> object:
        """Call the library function `arv_camera_<name>` on the camera."""
        ...


class AravisRegion:
    """Sets region and binning of one open camera."""

    def __init__(self, features: FeatureAccess, *, label: str) -> None:
        self._features = features
        self._label = label

    def apply(self, options: RegionOptions, settings: CameraSettings) -> Binning:
        """Set the region, and binning if the camera averages exactly its pixels; return the camera's binning.

        1 leaves the averaging to the host: for a camera that can only sum, a Bayer mosaic, or a region that
        begins at an odd pixel or that the camera does not take at half the size.
        """
        self._write_binning(1)
        self._set_sensor_region(options)
        if settings.binning == 1 or settings.pixel_format not in GREY:
            return 1
        whole = self._read()
        x, y, width, height = whole
        if x % 2 or y % 2 or not self._averages():
            return 1
        half = (x // 2, y // 2, width // 2, height // 2)
        try:
            self._write_binning(2)
            self._write(half)
            if self._read() == half:
                return 2
        except (OutOfRange, DeviceFault) as refused:
            logger.info("%s: the host averages its pixels: %s", self._label, refused)
        self._write_binning(1)
        self._write(whole)
        return 1

    def _averages(self) -> bool:
        """Make both axes average instead of adding up, which saturates; return whether the camera can."""
        modes = [f"{axis}Mode" for axis in AXES]
        if not all(self._features.has(name) for name in (*AXES, *modes)):
            return False
        if not all(AVERAGE in self._features.choices(mode) for mode in modes):
            logger.info("%s: its binning adds pixels up; the host averages them instead", self._label)
            return False
        for mode in modes:
            self._features.choose(mode, AVERAGE)
        return all(self._features.text(mode) == AVERAGE for mode in modes)

    def _write_binning(self, binning: Binning) -> None:
        """Set both axes; the second of a camera that links them is already set."""
        for axis in AXES:
            if self._features.has(axis) and self._features.integer(axis) != binning:
                self._features.call("set_integer", axis.encode(), binning)

    def _set_sensor_region(self, options: RegionOptions) -> None:
        whole_width, whole_height = c_int(), c_int()
        self._features.call("get_sensor_size", byref(whole_width), byref(whole_height))
        width = options.width_px or whole_width.value
        height = options.height_px or whole_height.value
        if width > whole_width.value or height > whole_height.value:
            raise OutOfRange(
                f"{self._label}: asked for {width}x{height} pixels, but its sensor has {whole_width.value}x"
                f"{whole_height.value}; take a smaller part of it"
            )
        x = (whole_width.value - width) // 2 if options.offset_x_px is None else options.offset_x_px
        y = (whole_height.value - height) // 2 if options.offset_y_px is None else options.offset_y_px
        step_x, step_y = (self._increment(f"get_{axis}_offset_increment") for axis in "xy")
        self._write((x // step_x * step_x, y // step_y * step_y, width, height))

    def _increment(self, name: str) -> int:
        value = self._features.call(name)
        return max(1, value) if isinstance(value, int) else 1

    def _read(self) -> tuple[int, ...]:
        return tuple(self._features.integer(name) for name in REGION)

    def _write(self, region: tuple[int, ...]) -> None:
        self._features.call("set_region", *region)
