"""Depth at a time of a recording, computed from its frames, poses and own calibration."""

import threading
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from foveacam_hardware.contract import Sighting
from foveacam_pipeline.capture.recording.observations import observation_of
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.values import RecordedFrame
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.accumulate import DisparityStack
from foveacam_pipeline.stereo.depth import depth_map
from foveacam_pipeline.stereo.estimator import DepthEstimator
from foveacam_pipeline.stereo.pictures import depth_picture
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_pipeline.stereo.values import DepthMap
from foveacam_server.resources.capturing.recordings.moments import pair_at
from foveacam_server.resources.capturing.recordings.opened import OpenRecordings
from foveacam_server.rig.encoder import encode_jpeg

KEPT = 4
"""Number of results cached in memory, so that a picture is served without computing again."""
QUALITY = 88
CENTRE_SHARE = 0.1
"""Side of the central box whose median is reported, as a share of the picture's."""
CENTRE_KNOWN = 0.05
"""Share of known pixels in the box below which the centre has no depth."""


class BackendsByName(Protocol):
    """Opens depth backends by name."""

    def open(self, name: str, *, research_confirmed: bool) -> tuple[DepthEstimator, str | None]:
        """Return a backend and the SHA-256 of its graph; raise NotFound or InvalidInput."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthOrder:
    """Depth estimator and fusion. `looks`: most looks to fuse, while the mirrors do not move."""

    backend: str = "sgbm"
    research_confirmed: bool = False
    looks: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedDepth:
    """Depth along the rig's z at the centre of the left fovea, with its standard error, m; None: unknown.

    `verged_z_m`: where the gazes cross. `known`: share of pixels with depth. `apart_ms`: between the eyes'
    exposures. `looks`: number of fused looks. `sha256`: of a network's
    graph. `picture`: JPEG.
    """

    t_ns: int
    z_m: float | None
    sigma_m: float | None
    verged_z_m: float | None
    known: float
    apart_ms: float
    looks: int
    sha256: str | None
    picture: bytes


class RecordedDepthService:
    """Computes depth on request, one at a time, and caches the last results."""

    def __init__(self, opened: OpenRecordings, backends: BackendsByName) -> None:
        self._opened = opened
        self._backends = backends
        self._lock = threading.Lock()
        self._kept: OrderedDict[tuple[Path, int, int, DepthOrder], RecordedDepth] = OrderedDict()

    def at(self, path: Path, *, t_s: float, order: DepthOrder) -> RecordedDepth:
        """Return the depth at a time; raise `NotCalibrated`, `NotFound` or `InvalidInput` without one."""
        with self._opened.reading(path) as recording:
            pair = pair_at(recording, t_s)
            observations, calibration = _observations_at_rest(recording, pair, order.looks)
        key = path, pair[0].t_ns, pair[1].t_ns, order
        with self._lock:
            found = self._kept.get(key)
            if found is None:
                backend, sha256 = self._backends.open(
                    order.backend, research_confirmed=order.research_confirmed
                )
                rectified = rectify(observations[0], calibration, scale=0.5)
                stack = DisparityStack()
                for sighting in observations:
                    each = rectify(sighting, calibration, scale=0.5)
                    stack = stack.with_map(backend.estimate(each))
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
                    sha256=sha256,
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
