"""The part of its sensor that a Basler camera reads, and its own binning of that part."""

import logging
from dataclasses import dataclass

from foveacam_hardware.contract import Binning, CameraSettings, DeviceFault, OutOfRange
from foveacam_hardware.drivers.cameras.frame_checks import GREY
from foveacam_hardware.drivers.cameras.pylon import nodes

logger = logging.getLogger(__name__)

AXES = ("BinningHorizontal", "BinningVertical")
AVERAGE = "Average"
REGION = (("OffsetX", "Width"), ("OffsetY", "Height"))


@dataclass(frozen=True, slots=True, kw_only=True)
class RegionOptions:
    """Rig file options in pixels of the sensor; None: all of it, centred."""

    width: int | None = None
    height: int | None = None
    offset_x: int | None = None
    offset_y: int | None = None


def set_sensor_region(map_: nodes.Nodes, options: RegionOptions, *, label: str) -> None:
    """Set the region of the rig file, at binning 1."""
    _write_binning(map_, 1, label=label)
    for axis, place, size, offset in (
        ("Width", "OffsetX", options.width, options.offset_x),
        ("Height", "OffsetY", options.height, options.offset_y),
    ):
        nodes.write_whole(map_, place, 0, label=label)
        whole = int(map_.GetNode(axis).GetMax())
        nodes.write_whole(map_, axis, size or whole, label=label)
        step = int(map_.GetNode(place).GetInc())
        middle = (whole - (size or whole)) // 2 // step * step
        nodes.write_whole(map_, place, middle if offset is None else offset, label=label)


def apply_binning(map_: nodes.Nodes, asked: CameraSettings, options: RegionOptions, *, label: str) -> Binning:
    """Set the binning where the camera averages exactly the region's pixels; return the camera's binning.

    1 leaves the averaging to the host: for a camera that can only sum, a Bayer mosaic, or a region that
    begins at an odd pixel or that the camera does not take at half the size.
    """
    if _read_binning(map_) != (1, 1):
        set_sensor_region(map_, options, label=label)
    if asked.binning == 1 or asked.pixel_format not in GREY:
        return 1
    whole = [tuple(int(map_.GetNode(name).GetValue()) for name in pair) for pair in REGION]
    if any(offset % 2 for offset, _ in whole) or not _averages(map_, label=label):
        return 1
    half = [(offset // 2, size // 2) for offset, size in whole]
    try:
        _write_binning(map_, 2, label=label)
        for (place, axis), (offset, size) in zip(REGION, half, strict=True):
            nodes.write_whole(map_, place, 0, label=label)
            nodes.write_whole(map_, axis, size, label=label)
            nodes.write_whole(map_, place, offset, label=label)
    except (OutOfRange, DeviceFault) as refused:
        logger.info("%s: the host averages its pixels: %s", label, refused)
        set_sensor_region(map_, options, label=label)
        return 1
    return 2


def _averages(map_: nodes.Nodes, *, label: str) -> bool:
    """Make both axes average instead of adding up, which saturates; return whether the camera can."""
    if any(nodes.find(map_, (axis,)) is None for axis in AXES):
        return False
    modes = [f"{axis}Mode" for axis in AXES]
    if not all(AVERAGE in nodes.choices(map_, mode) for mode in modes):
        logger.info("%s: its binning adds pixels up; the host averages them instead", label)
        return False
    for mode in modes:
        nodes.write_choice(map_, mode, AVERAGE, label=label)
    return True


def _read_binning(map_: nodes.Nodes) -> tuple[int, ...]:
    found = (nodes.find(map_, (axis,)) for axis in AXES)
    return tuple(1 if node is None else int(node.GetValue()) for node in found)


def _write_binning(map_: nodes.Nodes, binning: Binning, *, label: str) -> None:
    """Set both axes; the second of a camera that links them is already set."""
    for axis in AXES:
        node = nodes.find(map_, (axis,))
        if node is not None and int(node.GetValue()) != binning:
            nodes.write_whole(map_, axis, binning, label=label)
