"""A recording of a painted plane, whose depth and outlines are known."""

from dataclasses import replace
from pathlib import Path

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.recording.poses import raw_frame
from foveacam_pipeline.capture.recording.recorder import Recorder
from foveacam_pipeline.capture.recording.session import RecordingSession, RigDescription
from foveacam_pipeline.capture.recording.values import STREAM_OF_ROLE
from foveacam_pipeline.models import Calibration
from tests.support.scenes.dataset_scenes import CALIBRATION, noise_texture, plane_point

Z_M = 4.0
PERIOD_S = 0.1


def look(
    path: Path,
    *,
    calibration: Calibration | None = CALIBRATION,
    volts: bool = True,
    looks: int = 2,
    moving: bool = False,
    right_late_ns: int = 0,
) -> Path:
    """Record looks at a plane, `PERIOD_S` apart; the foveae are 10 ms later than the wide camera.

    `moving`: each look has other volts (and the same pictures). `right_late_ns`: of the right eye.
    """
    rig = RigDescription(
        rig_id=CALIBRATION.rig_id, name="a rig", baseline_m=CALIBRATION.baseline_m, calibration=calibration
    )
    point, _ = plane_point(0, aim_deg=(2.0, -1.0), z_m=Z_M, texture=noise_texture())
    with Recorder(path, RecordingSession(timestamp="2026-01-31T12:00:00+00:00", rig=rig)) as recorder:
        for tick in range(looks):
            for shot in point.shots:
                frame = shot.frame
                late_ns = 0 if frame.role is Role.WIDE else 10_000_000
                late_ns += right_late_ns if frame.role is Role.RIGHT else 0
                at = frame.volts
                if at is not None and moving:
                    at = replace(at, x_v=at.x_v + 0.5 * tick)
                frame = type(frame)(
                    image=frame.image, role=frame.role, seq=tick, exposure_ns=5_000_000, bits=frame.bits,
                    t_ns=10**9 + round(tick * PERIOD_S * 1e9) + late_ns, volts=at if volts else None,
                )  # fmt: skip
                recorder.publish(STREAM_OF_ROLE[frame.role], raw_frame(frame, calibration=calibration))
    return path
