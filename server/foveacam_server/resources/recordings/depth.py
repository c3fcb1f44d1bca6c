"""Depth at a time of a recording, computed from its frames, poses and own calibration."""

import threading
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from foveacam_hardware.contract import Sighting
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.values import RecordedFrame
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.accumulate import DisparityStack
from foveacam_pipeline.stereo.depth import depth_map
from foveacam_pipeline.stereo.estimator import BACKENDS, DepthBackend
from foveacam_pipeline.stereo.pictures import depth_picture
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_pipeline.stereo.values import DepthMap
from foveacam_server.resources.recordings.moments import observation_of, pair_at
from foveacam_server.resources.recordings.opened import OpenRecordings
from foveacam_server.rig.encoder import encode_jpeg

KEPT = 4
"""Results in memory, so that fetching their picture computes nothing."""
QUALITY = 88
CENTRE_SHARE = 0.1
"""Side of the central box whose median is reported, as a share of the picture's."""
CENTRE_KNOWN = 0.05
"""Below this share of known pixels the centre has no depth."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedDepth:
    """Depth along the rig's z at the centre of the left fovea, with its standard error, m; None: unknown.

    `verged_z_m`: where the gazes cross. `known`: share of pixels with depth. `apart_ms`: between the eyes'
    exposures. `looks`: number of fused looks. `picture`: JPEG.
    """

    t_ns: int
    z_m: float | None
    sigma_m: float | None
    verged_z_m: float | None
    known: float
    apart_ms: float
    looks: int
    picture: bytes


class RecordedDepthService:
    """Computes depth on request, one at a time, and caches the last results."""

    def __init__(self, opened: OpenRecordings) -> None:
        self._opened = opened
        self._lock = threading.Lock()
        self._kept: OrderedDict[tuple[Path, int, int, DepthBackend, int], RecordedDepth] = OrderedDict()

    def at(self, path: Path, *, t_s: float, backend: DepthBackend = "sgbm", looks: int = 1) -> RecordedDepth:
        """Return the depth at a time; raise `NotCalibrated` or `InvalidInput` where there is none.

        `looks`: most looks to fuse from that time on, while the mirrors do not move.
        """
        with self._opened.reading(path) as recording:
            pair = pair_at(recording, t_s)
            observations, calibration = _observations_at_rest(recording, pair, looks)
        key = path, pair[0].t_ns, pair[1].t_ns, backend, looks
        with self._lock:
            found = self._kept.get(key)
            if found is None:
                rectified = rectify(observations[0], calibration, scale=0.5)
                stack = DisparityStack()
                for sighting in observations:
                    each = rectify(sighting, calibration, scale=0.5)
                    stack = stack.with_map(BACKENDS[backend].estimate(each))
                fused = stack.fused() if len(observations) > 1 else stack.maps[0]
                depth = depth_map(rectified, fused)
                z_m, sigma_m = centre_of(depth)
                verged_z_m = rectified.verged_z_m
                found = RecordedDepth(
                    t_ns=pair[0].t_ns,
                    z_m=z_m,
                    sigma_m=sigma_m,
                    verged_z_m=verged_z_m if np.isfinite(verged_z_m) else None,
                    known=float(np.isfinite(depth.z_m).mean()),
                    apart_ms=abs(pair[1].t_ns - pair[0].t_ns) / 1e6,
                    looks=len(observations),
                    picture=encode_jpeg(depth_picture(depth), quality=QUALITY),
                )
                self._kept[key] = found
            self._kept.move_to_end(key)
            while len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        return found


def _observations_at_rest(
    recording: Recording, pair: tuple[RecordedFrame, RecordedFrame], looks: int
) -> tuple[list[Sighting], Calibration]:
    """Return at most `looks` observations from a pair on, while the mirrors' volts stay the same."""
    sighting, calibration = observation_of(recording, pair)
    observations = [sighting]
    left, right = (recording.stream(frame.stream) for frame in pair)
    for index in range(pair[0].index + 1, min(pair[0].index + looks, len(left))):
        following = recording.frame(left.name, index)
        partner = recording.nearest(right.name, following.t_ns)
        drives = following.pose.volts, partner.pose.volts
        if drives != (sighting.volts.left, sighting.volts.right):
            break
        observations.append(observation_of(recording, (following, partner))[0])
    return observations, calibration


def centre_of(depth: DepthMap) -> tuple[float | None, float | None]:
    """Return the central box's median depth and standard error, m; None with too few known pixels."""
    height, width = depth.z_m.shape
    half_y, half_x = max(1, round(0.5 * CENTRE_SHARE * height)), max(1, round(0.5 * CENTRE_SHARE * width))
    box = slice(height // 2 - half_y, height // 2 + half_y), slice(width // 2 - half_x, width // 2 + half_x)
    z_m = depth.z_m[box]
    known = np.isfinite(z_m)
    if known.mean() < CENTRE_KNOWN:
        return None, None
    own_m, pose_m = (float(np.median(sigma[box][known])) for sigma in (depth.sigma_m, depth.pose_sigma_m))
    return float(np.median(z_m[known])), float(np.hypot(own_m, pose_m))
