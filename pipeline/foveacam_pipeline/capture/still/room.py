"""How much memory and disk a still takes, and what is refused before it is taken."""

from foveacam_hardware.contract import OutOfRange, Role
from foveacam_pipeline.capture.plan import ImageSize
from foveacam_pipeline.capture.still.values import StillKeep, StillPlan
from foveacam_pipeline.storage.free_space import RESERVE_BYTES, RESERVE_TEXT, free_space_error

MOST_BYTES = 1 << 30
"""Of frames, held in memory until they are written."""


def still_bytes(plan: StillPlan, *, fovea: ImageSize, wide: ImageSize) -> int:
    """Return how large its images are, not compressed: most that they take."""
    mean = plan.keep is StillKeep.MEAN and plan.frames > 1
    count = 1 if mean else plan.frames
    return sum(count * (wide if role is Role.WIDE else fovea).raw_bytes(mean=mean) for role in plan.roles)


def check_still_room(needed_bytes: int, *, free_bytes: int) -> None:
    """Raise OutOfRange, or StorageFull for a full disk, with both figures when it does not fit."""
    if needed_bytes > MOST_BYTES:
        raise OutOfRange(
            f"still: its frames take {needed_bytes / 1e9:.2f} GB, at most {MOST_BYTES / 1e9:.2f} GB are held"
            " in memory; keep the mean of each stack, or take fewer frames",
            asked=f"{needed_bytes} bytes",
            found=f"{MOST_BYTES} bytes at most",
        )
    wanted_bytes = needed_bytes + RESERVE_BYTES
    if wanted_bytes > free_bytes:
        raise free_space_error(
            f"still: it needs up to {wanted_bytes / 1e6:.0f} MB, with the {RESERVE_TEXT};"
            f" {free_bytes / 1e6:.0f} MB are free on the disk; free some, or keep the mean of fewer frames",
            needed_bytes=wanted_bytes,
            free_bytes=free_bytes,
            remedy="free some, or keep the mean of fewer frames",
        )
