"""Verged pairs from a recording, to train on: one for each rest of the mirrors."""

import hashlib
from pathlib import Path

import numpy as np

from foveacam_hardware.contract import InvalidInput, MirrorVolts
from foveacam_pipeline.capture.recording.observations import (
    EYES,
    calibration_of,
    observation_of,
    stream_of,
)
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.values import OLD_SUFFIX, SUFFIX, RecordedFrame
from foveacam_pipeline.learn.pair_folder import PairSample
from foveacam_pipeline.stereo.rectify import rectify

MOST_PAIRS = 400
"""Largest number of pairs from a recording, evenly spread."""
APART_NS = 2_000_000
"""Frames of both eyes exposed farther apart than this show different moments."""
_CHUNK_BYTES = 1 << 24


def is_recording(path: Path) -> bool:
    """Return whether a path names a recording, by its suffix."""
    return path.suffix in (SUFFIX, OLD_SUFFIX)


def recorded_pairs(path: Path, *, scale: float) -> tuple[PairSample, ...]:
    """Return the rectified pairs, one of each rest of the mirrors, in order of time.

    Raise InvalidInput for a recording without a calibration, without frames of both eyes, or that cannot be
    read.
    """
    with Recording(path) as recording:
        calibration = calibration_of(recording)
        if calibration is None:
            raise InvalidInput(f"{path} has no calibration: it has no rectified pairs; leave it out")
        found = _rests(recording)
        chosen = np.unique(np.linspace(0, len(found) - 1, min(len(found), MOST_PAIRS)).round().astype(int))
        looks = (observation_of(recording, _frames(recording, *found[number]))[0] for number in chosen)
        pairs = (rectify(each, calibration, scale=scale) for each in looks)
        return tuple(PairSample(pair=pair) for pair in pairs if np.isfinite(pair.verged_z_m))


def recording_digest(path: Path) -> str:
    """Return the SHA-256 of the file."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK_BYTES):
            digest.update(chunk)
    return digest.hexdigest()


def _rests(recording: Recording) -> list[tuple[int, int]]:
    """Return left and right frame of each rest: the last before the mirrors move, when they have settled."""
    left, right = (stream_of(recording, role) for role in EYES)
    rests: list[tuple[int, int]] = []
    resting: tuple[MirrorVolts, MirrorVolts] | None = None
    for index in range(len(left)):
        partner = int(np.argmin(np.abs(right.t_ns - left.t_ns[index])))
        if abs(int(right.t_ns[partner]) - int(left.t_ns[index])) > APART_NS:
            continue
        volts = recording.pose(left.name, index).volts, recording.pose(right.name, partner).volts
        if volts[0] is None or volts[1] is None:
            continue
        place = volts[0], volts[1]
        if place == resting:
            rests[-1] = index, partner
        else:
            rests.append((index, partner))
            resting = place
    return rests


def _frames(recording: Recording, left: int, right: int) -> tuple[RecordedFrame, RecordedFrame]:
    names = [stream_of(recording, role).name for role in EYES]
    return recording.frame(names[0], left), recording.frame(names[1], right)
