"""A rig that plays a recording: its cameras, its mirrors, the head that they make; nothing else is there.

Beside `rig` the module that names the drivers of this. The recording itself is given: files of the
pipeline are not read here.
"""

import numpy as np

from foveacam_hardware.contract import Camera, Clock, InvalidInput, MonotonicClock, Role
from foveacam_hardware.drivers.cameras.absent import AbsentCamera
from foveacam_hardware.drivers.replay.camera import ReplayCamera
from foveacam_hardware.drivers.replay.head import ReplayHead
from foveacam_hardware.drivers.replay.mirrors import ReplayMirrors
from foveacam_hardware.drivers.replay.source import RecordedCamera, RecordedRig
from foveacam_hardware.drivers.replay.timeline import Playback, PlaybackTimeline
from foveacam_hardware.rig import Rig, RigName

USUAL_GAP_NS = 33_333_333
"""Between the last frame and the first one of the next lap, where one frame is all there is."""


def replay_rig(recorded: RecordedRig, *, playback: Playback | None = None, clock: Clock | None = None) -> Rig:
    """Return the rig of a recording, not yet connected; closing it releases the recording."""
    if not recorded.cameras:
        raise InvalidInput(
            f"replay: {recorded.name} has no frames of a wide, a left or a right camera;"
            " choose another recording"
        )
    clock = clock or MonotonicClock()
    tape = _tape(recorded, playback or Playback(), clock)
    playing = {
        role: ReplayCamera(role, camera, tape, clock=clock) for role, camera in recorded.cameras.items()
    }
    wide, left, right = (_camera(role, playing) for role in (Role.WIDE, Role.LEFT, Role.RIGHT))
    who = RigName(rig_id=recorded.rig_id, name=recorded.name, simulated=False, baseline_m=recorded.baseline_m)
    eyes = playing.get(Role.LEFT), playing.get(Role.RIGHT)
    rig = Rig(
        who,
        clock=clock,
        mirrors=ReplayMirrors(eyes, clock=clock, name=recorded.name),
        cameras=(wide, left, right),
        head=ReplayHead(left, right, wide, clock=clock),
    )
    rig.replayed = True
    rig.own([recorded])
    return rig


def _camera(role: Role, playing: dict[Role, ReplayCamera]) -> Camera:
    if role in playing:
        return playing[role]
    return AbsentCamera(role, reason="the recording has no frames of it", remedy="choose one that has")


def _tape(recorded: RecordedRig, playback: Playback, clock: Clock) -> PlaybackTimeline:
    cameras = recorded.cameras.values()
    return PlaybackTimeline(
        clock,
        playback,
        first_ns=min(int(camera.t_ns[0]) for camera in cameras),
        last_ns=max(int(camera.t_ns[-1]) for camera in cameras),
        gap_ns=min(_gap_ns(camera) for camera in cameras),
    )


def _gap_ns(camera: RecordedCamera) -> int:
    """Return the usual time between two frames."""
    return int(np.median(np.diff(camera.t_ns))) if len(camera.t_ns) > 1 else USUAL_GAP_NS
