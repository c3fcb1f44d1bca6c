"""Still captures: a stack of every camera where the mirrors stand, kept as a dataset of one point."""

from foveacam_pipeline.capture.still.keep import StillLabels, write_still
from foveacam_pipeline.capture.still.room import check_still_room, still_bytes
from foveacam_pipeline.capture.still.take import StillWatcher, take_still
from foveacam_pipeline.capture.still.values import (
    MOST_FRAMES,
    MissingFrames,
    Still,
    StillFrame,
    StillKeep,
    StillPlan,
)

__all__ = [
    "MOST_FRAMES",
    "MissingFrames",
    "Still",
    "StillFrame",
    "StillKeep",
    "StillLabels",
    "StillPlan",
    "StillWatcher",
    "check_still_room",
    "still_bytes",
    "take_still",
    "write_still",
]
