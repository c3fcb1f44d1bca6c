"""A moment of a recording: every camera's nearest frame, pose and footprint, as documents and pairs."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role, Sighting, StereoVolts
from foveacam_pipeline.capture.recording.movie import rgb_picture
from foveacam_pipeline.capture.recording.observations import EYES, calibration_of, stream_of
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.values import FramePose, RecordedFrame, RecordedStream, nearest_index
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.footprint import fovea_footprint_px
from foveacam_pipeline.stereo import pictures
from foveacam_pipeline.stereo.pictures import AnaglyphStyle
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_server.resources.capturing.recordings.documents import URL
from foveacam_server.resources.capturing.recordings.overlays import (
    crossing_of_angles,
    distorted_px,
    wide_boxes,
    wide_pixel,
)
from foveacam_server.resources.capturing.recordings.schema import (
    MomentDocument,
    RecordedFrameDocument,
    TimelineDocument,
    TimelineStream,
)

NEAREST_M, FARTHEST_M = 0.3, 300.0
"""Limits of the distance at which gazes cross; outside, they count as parallel, with footprints at
infinity."""
RECTIFIED_SCALE = 0.5


def timeline_document(recording: Recording) -> TimelineDocument:
    """Return the exposure times of all frames, seconds from the recording's start."""
    begin_ns, end_ns = recording.span_ns
    return TimelineDocument(
        duration_s=(end_ns - begin_ns) / 1e9,
        calibrated=calibration_of(recording) is not None,
        streams=[
            TimelineStream(
                role=role.value,
                name=stream.name,
                fps=round(stream.fps, 3),
                width=stream.form.width,
                height=stream.form.height,
                t_s=np.round((stream.t_ns - begin_ns) / 1e9, 6).tolist(),
            )
            for role, stream in _streams(recording).items()
        ],
    )


def moment_document(recording: Recording, recording_id: str, *, t_s: float) -> MomentDocument:
    """Return the frames nearest to `t_s` after the start, with poses, footprints and picture URLs."""
    t_ns = _moment_ns(recording, t_s)
    poses = {role: (stream, nearest_index(stream.t_ns, t_ns)) for role, stream in _streams(recording).items()}
    frames = {
        role: _frame_document(recording, recording_id, role, *position, begin_ns=recording.span_ns[0])
        for role, position in poses.items()
    }
    found = {role: recording.pose(stream.name, index) for role, (stream, index) in poses.items()}
    meeting_m = _meeting_point(recording, found)
    distance_m = math.inf if meeting_m is None else float(np.linalg.norm(meeting_m))
    for role in EYES:
        if role in frames:
            frames[role].footprint_px = _footprint(recording, role, found[role], distance_m)
    return MomentDocument(
        t_s=round((t_ns - recording.span_ns[0]) / 1e9, 6),
        frames={role.value: document for role, document in frames.items()},
        meeting_m=None if math.isinf(distance_m) else round(distance_m, 4),
        meeting_z_m=None if meeting_m is None else round(float(meeting_m[2]), 4),
        meeting_px=None if meeting_m is None else wide_pixel(recording, meeting_m),
        boxes=wide_boxes(recording, t_ns),
    )


def frame_time_s(recording: Recording, role: Role, index: int) -> float:
    """Return a frame's exposure time, seconds from the start; a negative `index` counts from the end."""
    stream = stream_of(recording, role)
    if not -len(stream) <= index < len(stream):
        raise InvalidInput(
            f"frame {index} of {role.value}: the recording has {len(stream)}; choose one of them"
        )
    return float(stream.t_ns[index] - recording.span_ns[0]) / 1e9


def pair_at(recording: Recording, t_s: float) -> tuple[RecordedFrame, RecordedFrame]:
    """Return the left frame nearest to a time, and the right frame nearest to that one."""
    streams = [stream_of(recording, role) for role in EYES]
    left = recording.nearest(streams[0].name, _moment_ns(recording, t_s))
    return left, recording.nearest(streams[1].name, left.t_ns)


def anaglyph(
    pair: tuple[RecordedFrame, RecordedFrame],
    look: tuple[Sighting, Calibration] | None,
    style: AnaglyphStyle = AnaglyphStyle.RED_CYAN,
) -> NDArray[np.uint8]:
    """Return (h, w, 3) RGB: each eye in the colour of its glass; rectified with an observation, else raw."""
    if look is not None:
        return pictures.anaglyph(rectify(look[0], look[1], scale=RECTIFIED_SCALE), style)
    return pictures.overlay_eyes(*_same_size(pair), style)


def difference(
    pair: tuple[RecordedFrame, RecordedFrame], look: tuple[Sighting, Calibration] | None
) -> NDArray[np.uint8]:
    """Return (h, w, 3) RGB: left minus right about middle grey; rectified with an observation, else raw."""
    if look is not None:
        return pictures.difference(rectify(look[0], look[1], scale=RECTIFIED_SCALE))
    left, right = _same_size(pair)
    return pictures.subtract_eyes(left, right, np.ones(left.shape[:2], dtype=np.bool_))


def _same_size(pair: tuple[RecordedFrame, RecordedFrame]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return both frames as RGB, cropped to their common size."""
    left, right = (rgb_picture(frame) for frame in pair)
    height, width = (min(left.shape[axis], right.shape[axis]) for axis in (0, 1))
    return left[:height, :width], right[:height, :width]


def _streams(recording: Recording) -> dict[Role, RecordedStream]:
    found = {role: recording.stream_of_role(role) for role in Role}
    return {role: stream for role, stream in found.items() if stream is not None and len(stream)}


def _moment_ns(recording: Recording, t_s: float) -> int:
    begin_ns, end_ns = recording.span_ns
    return min(max(begin_ns + round(t_s * 1e9), begin_ns), end_ns)


def _frame_document(
    recording: Recording, recording_id: str, role: Role, stream: RecordedStream, index: int, *, begin_ns: int
) -> RecordedFrameDocument:
    pose = recording.pose(stream.name, index)
    angles_deg = None if pose.angles_rad is None else [math.degrees(angle) for angle in pose.angles_rad]
    return RecordedFrameDocument(
        stream=stream.name,
        index=index,
        t_s=round((int(stream.t_ns[index]) - begin_ns) / 1e9, 6),
        exposure_ms=None if pose.exposure_ns is None else pose.exposure_ns / 1e6,
        x_v=None if pose.volts is None else round(pose.volts.x_v, 4),
        y_v=None if pose.volts is None else round(pose.volts.y_v, 4),
        volts_source=pose.volts_source,
        ax_deg=None if angles_deg is None else round(angles_deg[0], 5),
        ay_deg=None if angles_deg is None else round(angles_deg[1], 5),
        footprint_px=None,
        jpeg_url=f"{URL}/{recording_id}/frames/{role.value}/{index}.jpg",
    )


def _meeting_point(recording: Recording, poses: dict[Role, FramePose]) -> NDArray[np.float64] | None:
    """Return where the gazes cross, (3,) m in the rig frame; None when they do not, within the limits.

    By the calibration and the volts, or, without a calibration, by the recorded angles and baseline.
    """
    pair = [poses[role] for role in EYES if role in poses]
    if len(pair) < len(EYES):
        return None
    left, right = pair
    calibration = calibration_of(recording)
    if calibration is None:
        point_m = crossing_of_angles(recording, left, right)
    elif left.volts is None or right.volts is None:
        return None
    else:
        meeting = calibration.meeting(StereoVolts(left=left.volts, right=right.volts))
        point_m = meeting.point_m if meeting.in_front else None
    if point_m is None or not NEAREST_M < float(np.linalg.norm(point_m)) < FARTHEST_M:
        return None
    return point_m


def _footprint(
    recording: Recording, role: Role, pose: FramePose, distance_m: float
) -> list[tuple[float, float]] | None:
    """Return a fovea's corners (x, y) in the wide picture, px, clockwise; None when they are unknown.

    From the calibration, or, in a recording without one, from the affine transform stored with the frame,
    which is for infinity.
    """
    calibration = calibration_of(recording)
    if calibration is not None and pose.volts is not None:
        corners = fovea_footprint_px(calibration, role, pose.volts, distance_m)
    elif pose.wide_from_fovea is not None:
        form = stream_of(recording, role).form
        right, bottom = form.binning * form.width - 0.5, form.binning * form.height - 0.5
        rim = np.array([[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]])
        corners = distorted_px(recording, homography_apply(pose.wide_from_fovea, rim))
    else:
        return None
    if not np.isfinite(corners).all():
        return None
    return [(float(x), float(y)) for x, y in np.round(corners, 2)]
