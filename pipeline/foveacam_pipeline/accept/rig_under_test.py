"""The rig during an acceptance run: looks that may lose a frame, markers in them, settings to restore."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    PARKED,
    Camera,
    CameraSettings,
    Clock,
    DeviceFault,
    Frame,
    LookOptions,
    MirrorVolts,
    Role,
    Sighting,
    StereoVolts,
    Timeout,
)
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.markers import find_markers, middle_px
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, raise_if_cancelled
from foveacam_pipeline.capture.run.access import CaptureRig, RigAccess
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8

T = TypeVar("T")

EYES = (Role.LEFT, Role.RIGHT)
TRIES = 4
REST_US = 80_000
"""Wait after which every mirror rests, even behind a filter of half the cut-off."""
REST = LookOptions(settle_us=REST_US)
DOING = "the acceptance run"


@dataclass(slots=True)
class LookCounts:
    """How many looks were made, and how many frames of each fovea were missing in them."""

    looks: int = 0
    missing: dict[Role, int] = field(default_factory=lambda: dict.fromkeys(EYES, 0))


class RigUnderTest:
    """Access to a rig for the checks, on the caller's thread."""

    def __init__(
        self, access: RigAccess, layout: MarkerLayout, watch: ProcedureWatcher, *, begun: Callable[[], None]
    ) -> None:
        """`begun`: called before each look, and by other steps of a check."""
        self.access = access
        self.layout = layout
        self.counts = LookCounts()
        self._watch = watch
        self._begun = begun

    @property
    def clock(self) -> Clock:
        """The rig's clock."""
        return self.access.clock

    def step(self) -> None:
        """Count a step of the check for its progress; raise Cancelled when the run was cancelled."""
        raise_if_cancelled(self._watch, doing=DOING)
        self._begun()

    def look(self, volts: StereoVolts = PARKED, *, options: LookOptions = REST) -> Sighting:
        """Look, again where a fovea's frame is missing; raise the error of the last try."""
        self.step()
        for left in reversed(range(TRIES)):
            self.counts.looks += 1
            try:
                return self.access.head.look(volts, options=options)
            except (DeviceFault, Timeout) as error:
                self._count_missing(str(error))
                if left == 0:
                    raise
        raise AssertionError("unreachable: the last try returns or raises")

    def _count_missing(self, text: str) -> None:
        for role in EYES:
            if text.startswith(f"camera {role}"):
                self.counts.missing[role] += 1

    def wait(self, seconds: float) -> None:
        """Wait on the rig's clock."""
        self.clock.sleep_until_ns(self.clock.now_ns() + round(seconds * 1e9))

    def on_device(self, work: Callable[[CaptureRig], T]) -> T:
        """Run work that moves nothing on the thread of the devices; allowed after a cancel, to restore."""
        return self.access.run_still(work)

    def settings(self) -> dict[Role, CameraSettings]:
        """Return the settings in force of all cameras."""
        return self.on_device(lambda rig: {role: camera_of(rig, role).settings for role in Role})

    def configure(self, role: Role, **changes: object) -> None:
        """Change some settings of a camera."""

        def work(rig: CaptureRig) -> None:
            camera = camera_of(rig, role)
            camera.configure(replace(camera.settings, **changes))  # type: ignore[arg-type]  # named by the caller

        self.on_device(work)


def camera_of(rig: CaptureRig, role: Role) -> Camera:
    """Return the camera of a role."""
    return {Role.WIDE: rig.wide, Role.LEFT: rig.left, Role.RIGHT: rig.right}[role]


def frame_of(sighting: Sighting, role: Role) -> Frame:
    """Return a camera's frame of a look."""
    return {Role.WIDE: sighting.wide, Role.LEFT: sighting.left, Role.RIGHT: sighting.right}[role]


def shades_of(frame: Frame) -> NDArray[np.uint8]:
    """Return the grey picture of a frame, (h, w)."""
    return gray(to_uint8(frame))


def own_marker(frame: Frame, layout: MarkerLayout) -> MarkerView:
    """Return a camera's own marker in its frame; raise DeviceFault where it is not to be seen."""
    own = layout.id_of(frame.role)
    views = find_markers(
        shades_of(frame),
        side_m=layout.side_m,
        large=frame.role is not Role.WIDE,
        only=(own,),
        binning=frame.binning,
    )
    if own not in views:
        raise DeviceFault(
            f"the {frame.role} picture does not show marker {own} any more",
            remedy="keep rig and markers still, and nothing between them",
        )
    return views[own]


def marker_px(rig: RigUnderTest, sighting: Sighting, role: Role) -> NDArray[np.float64]:
    """Return the place (2,) of a fovea's own marker in a look, px of the sensor."""
    return middle_px(own_marker(frame_of(sighting, role), rig.layout))


def other_eye(role: Role) -> Role:
    """Return the other fovea."""
    return Role.RIGHT if role is Role.LEFT else Role.LEFT


def both(left: tuple[float, float], right: tuple[float, float]) -> StereoVolts:
    """Return the drive of both mirrors, volts (x, y) each."""
    return StereoVolts(
        left=MirrorVolts(x_v=left[0], y_v=left[1]), right=MirrorVolts(x_v=right[0], y_v=right[1])
    )
