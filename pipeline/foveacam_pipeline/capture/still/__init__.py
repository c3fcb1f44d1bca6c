"""Still captures: a stack of frames of every camera at the present gaze, stored as a dataset of one point."""

from foveacam_pipeline.capture.still.still_run import StillWatcher, take_still
from foveacam_pipeline.capture.still.still_writer import StillLabels, write_still
from foveacam_pipeline.capture.still.values import (
    MOST_FRAMES,
    MissingFrames,
    Still,
    StillFrame,
    StillKeep,
    StillPlan,
    check_still_room,
    still_bytes,
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
