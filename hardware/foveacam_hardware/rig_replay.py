"""A rig that plays a recording through replaying cameras, mirrors and head.

Besides `rig`, the only module that names these drivers. The recording is passed in; reading its file is left
to the pipeline.
"""

import numpy as np

from foveacam_hardware.contract import (
    PARKED,
    Camera,
    Clock,
    Frame,
    InvalidInput,
    LookOptions,
    MonotonicClock,
    Role,
    Sighting,
    StereoVolts,
)
from foveacam_hardware.drivers.cameras.absent import AbsentCamera
from foveacam_hardware.drivers.replay.camera import ReplayCamera
from foveacam_hardware.drivers.replay.mirrors import ReplayMirrors
from foveacam_hardware.drivers.replay.source import RecordedCamera, RecordedRig
from foveacam_hardware.drivers.replay.timeline import Playback, PlaybackTimeline
from foveacam_hardware.rig import Rig, RigName

SHARE = 0.5
"""Fraction of a frame period by which the two foveae of one look may differ in time."""


class ReplayHead:
    """Implements the contract's Head. `look` waits for the next recorded exposure of the left fovea.

    The requested volts are ignored; the observation carries the recorded ones (parked where none were
    recorded), so that computations from it stay correct.
    """

    def __init__(self, left: Camera, right: Camera, wide: Camera, *, clock: Clock) -> None:
        self._left = left
        self._right = right
        self._wide = wide
        self._clock = clock
        self.settle_us = 0

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        """Return the next recorded pair, with the wide frame of that time or the first one after it."""
        left = _since(self._left, self._clock.now_ns(), now_ns=self._clock.now_ns())
        period_ns = 1e9 / self._left.settings.frame_rate_hz
        from_ns = left.t_ns - round(SHARE * period_ns)
        right = _since(self._right, from_ns, now_ns=self._clock.now_ns())
        wide = _since(self._wide, from_ns, now_ns=self._clock.now_ns())
        drive = StereoVolts(left=left.volts or PARKED.left, right=right.volts or PARKED.right)
        return Sighting(left=left, right=right, wide=wide, volts=drive)

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        """Return a recent wide frame."""
        return self._wide.latest(max_age_ms=max_age_ms)

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Raise `InvalidInput` unless the values are those of the recording."""
        for camera in (self._left, self._right):
            now = camera.settings
            if (exposure_ns, gain_db) != (now.exposure_ns, now.gain_db):
                raise InvalidInput(
                    f"camera {camera.role}: asked for {exposure_ns / 1e6:g} ms and {gain_db:g} dB, but it"
                    f" plays a recording made with {now.exposure_ns / 1e6:g} ms; open a rig to expose anew"
                )

    def set_low_pass(self, cutoff_hz: int) -> int:
        """Raise `InvalidInput`: the filter of recorded mirrors cannot be changed."""
        raise InvalidInput(
            f"mirrors: asked to run at {cutoff_hz} Hz, but they are those of a recording; open a rig"
        )


def _since(camera: Camera, t_ns: int, *, now_ns: int) -> Frame:
    """Return a frame exposed at `t_ns` or later."""
    frame = camera.latest(max_age_ms=max(0.0, (now_ns - t_ns) / 1e6))
    while frame.t_ns < t_ns:
        frame = camera.read()
    return frame


DEFAULT_GAP_NS = 33_333_333
"""Time from the last frame to the first of the next loop, for a recording of a single frame."""


def replay_rig(recorded: RecordedRig, *, playback: Playback | None = None, clock: Clock | None = None) -> Rig:
    """Return a rig that plays a recording, not yet connected; closing it releases the recording."""
    if not recorded.cameras:
        raise InvalidInput(
            f"replay: {recorded.name} has no frames of a wide, a left or a right camera;"
            " choose another recording"
        )
    clock = clock or MonotonicClock()
    timeline = _timeline(recorded, playback or Playback(), clock)
    playing = {
        role: ReplayCamera(role, camera, timeline, clock=clock) for role, camera in recorded.cameras.items()
    }
    wide, left, right = (_camera(role, playing) for role in (Role.WIDE, Role.LEFT, Role.RIGHT))
    identity = RigName(
        rig_id=recorded.rig_id, name=recorded.name, simulated=False, baseline_m=recorded.baseline_m
    )
    eyes = playing.get(Role.LEFT), playing.get(Role.RIGHT)
    rig = Rig(
        identity,
        clock=clock,
        mirrors=ReplayMirrors(eyes, clock=clock, name=recorded.name),
        cameras=(wide, left, right),
        head=ReplayHead(left, right, wide, clock=clock),
    )
    rig.replayed = True
    rig.working_binning = 2 if any(camera.settings.binning == 2 for camera in playing.values()) else 1
    rig.own([recorded])
    return rig


def _camera(role: Role, playing: dict[Role, ReplayCamera]) -> Camera:
    if role in playing:
        return playing[role]
    return AbsentCamera(role, reason="the recording has no frames of it", remedy="choose one that has")


def _timeline(recorded: RecordedRig, playback: Playback, clock: Clock) -> PlaybackTimeline:
    cameras = recorded.cameras.values()
    return PlaybackTimeline(
        clock,
        playback,
        first_ns=min(int(camera.t_ns[0]) for camera in cameras),
        last_ns=max(int(camera.t_ns[-1]) for camera in cameras),
        gap_ns=min(_gap_ns(camera) for camera in cameras),
    )


def _gap_ns(camera: RecordedCamera) -> int:
    """Return the median time between two frames, ns."""
    return int(np.median(np.diff(camera.t_ns))) if len(camera.t_ns) > 1 else DEFAULT_GAP_NS
