"""Frames of a recording as observations: both eyes' frames with the mirrors' volts and the calibration."""

from foveacam_hardware.contract import Frame, InvalidInput, NotCalibrated, Role, Sighting, StereoVolts
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.values import RecordedFrame, RecordedStream
from foveacam_pipeline.models.calibration import Calibration

EYES = (Role.LEFT, Role.RIGHT)


def stream_of(recording: Recording, role: Role) -> RecordedStream:
    """Return the stream of a camera; raise `InvalidInput` when it has no frames."""
    stream = recording.stream_of_role(role)
    if stream is None or len(stream) == 0:
        raise InvalidInput(
            f"recording {recording.path.name} holds no frames of the {role.value} camera; its streams are"
            f" {', '.join(recording.streams) or 'none'}"
        )
    return stream


def calibration_of(recording: Recording) -> Calibration | None:
    """Return the calibration that a recording carries, if any."""
    return None if recording.rig is None else recording.rig.calibration


def observation_of(
    recording: Recording, pair: tuple[RecordedFrame, RecordedFrame]
) -> tuple[Sighting, Calibration]:
    """Return a pair as one observation, with the recording's calibration.

    Raise `NotCalibrated` without a calibration, `InvalidInput` without poses or with frames of another size
    than the calibrated one. The left frame replaces the wide one.
    """
    calibration = calibration_of(recording)
    if calibration is None:
        problem = None if recording.rig is None else recording.rig.problem
        raise NotCalibrated(
            f"recording {recording.path.name} carries no calibration that can be "
            f"used{'' if problem is None else f' ({problem})'}, and without one its pixels have no direction",
            found=problem or "no calibration in the recording",
            remedy="record with a calibrated rig",
        )
    left, right = (_checked(recording, frame, calibration) for frame in pair)
    drives = [frame.pose.volts for frame in pair]
    if drives[0] is None or drives[1] is None:
        raise InvalidInput(
            f"recording {recording.path.name}: the mirrors' pose is missing for this frame, so its "
            "direction is unknown",
            found="no volts with this frame",
            remedy="choose another moment, or a recording with volts",
        )
    return Sighting(
        left=left, right=right, wide=left, volts=StereoVolts(left=drives[0], right=drives[1])
    ), calibration


def _checked(recording: Recording, frame: RecordedFrame, calibration: Calibration) -> Frame:
    height, width = frame.image.shape[:2]
    own = calibration.binned(frame.binning)
    wanted = own.fovea_width, own.fovea_height
    if (width, height) != wanted:
        raise InvalidInput(
            f"recording {recording.path.name}: {frame.stream} is {width} x {height} px, its calibration is "
            f"of {wanted[0]} x {wanted[1]}",
            found=f"{width} x {height} px",
            remedy="record the full sensor",
        )
    return Frame(
        image=frame.image,
        role=Role.LEFT if frame.stream == stream_of(recording, Role.LEFT).name else Role.RIGHT,
        seq=frame.seq,
        t_ns=frame.t_ns,
        exposure_ns=frame.pose.exposure_ns or 0,
        bits=frame.bits,
        volts=frame.pose.volts,
        binning=frame.binning,
    )
