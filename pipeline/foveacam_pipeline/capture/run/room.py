"""How much memory and disk a capture takes: sizes of images, points that may wait, what is refused."""

from foveacam_hardware.contract import CameraSettings, OutOfRange, PixelFormat
from foveacam_pipeline.capture.dataset import WriterSettings
from foveacam_pipeline.capture.plan import ImageSize, RasterPlan

WAITING_BYTES = 48 << 20
"""Points that wait for the disk may take so much memory, but one may always wait."""
MOST_WAITING = 8
LARGEST_POINT_BYTES = 1 << 30
_FORMS = {
    PixelFormat.MONO8: (1, 8),
    PixelFormat.MONO12: (1, 12),
    PixelFormat.MONO12P: (1, 12),
    PixelFormat.BAYER_RG8: (3, 8),
    PixelFormat.BAYER_RG12P: (3, 12),
    PixelFormat.RGB8: (3, 8),
}
"""Channels and bits as a driver delivers each format."""


def image_size(settings: CameraSettings, *, width: int, height: int) -> ImageSize:
    """Return the size of a camera's images."""
    channels, bits = _FORMS[settings.pixel_format]
    return ImageSize(width=width, height=height, channels=channels, bits=bits)


def point_bytes(plan: RasterPlan, *, fovea: ImageSize, wide: ImageSize) -> int:
    """Return what the images of one point take in memory while they wait for the disk."""
    mean = plan.stack_frames > 1 and plan.stack_keep == "mean"
    frames = plan.exposures_per_point * (1 if mean else plan.stack_frames)
    wides = 0 if plan.wide == "none" else wide.raw_bytes()
    return 2 * frames * fovea.raw_bytes(mean=mean) + wides


def writer_settings(plan: RasterPlan, *, fovea: ImageSize, wide: ImageSize) -> WriterSettings:
    """Return how many points may wait; raise OutOfRange for points that are too large to be kept whole."""
    each = point_bytes(plan, fovea=fovea, wide=wide)
    if each > LARGEST_POINT_BYTES:
        raise OutOfRange(
            f"raster plan: the images of one point take {each / 1e9:.2f} GB, at most"
            f" {LARGEST_POINT_BYTES / 1e9:.2f} GB are held in memory; keep the mean of each stack, or take"
            " fewer frames",
            asked=f"{each} bytes a point",
            found=f"{LARGEST_POINT_BYTES} bytes at most",
        )
    return WriterSettings(depth=max(1, min(MOST_WAITING, WAITING_BYTES // each)))
