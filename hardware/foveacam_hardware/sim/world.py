"""The simulated world: the state of the mirrors, the rig and the scene at any time.

It implements the cables of the mirror controller and of the motors. Every call passes `t_ns`, so that a slow
machine lowers the frame rate and never changes the physics. Cameras are in `cameras`, moving objects in
`animated_scene`.
"""

import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Clock, MirrorVolts, Role
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.assembly import mount_turn_rad, wired_codes
from foveacam_hardware.sim.cables import CAMERA_ROLES, DacCodes, ShutterPort
from foveacam_hardware.sim.exposures import ExposureInterval
from foveacam_hardware.sim.faults import ThermalMountDrift, WorldFaults
from foveacam_hardware.sim.mirror import MirrorPair
from foveacam_hardware.sim.optics import (
    FOVEA_FOCAL_PX,
    FOVEA_HEIGHT,
    FOVEA_WIDTH,
    EyeAssembly,
    EyeProjection,
    FoldedEye,
    WideLens,
    built_assembly,
    wide_projections,
)
from foveacam_hardware.sim.pan_tilt import TurningHistory, TurnSegment
from foveacam_hardware.sim.presets import RigPreset
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.rig_pose import Pedestal
from foveacam_hardware.simulated_assembly import SimulatedAssembly

EYES = (Role.LEFT, Role.RIGHT)
TILT_STEP_RAD = 2.0**-22
"""Tilts are rounded to 0.01 fovea px, so that the image of a mirror at rest can be cached."""
MOUNT_STEP_RAD = 2.0**-19
"""Mounts drift in steps of 0.05 fovea px, some seconds apart, between which an image can be cached."""
SETTLED_PX = 1.0
"""A mirror that moves less than this during an exposure is rendered once, at its mean tilt.

The blur that this leaves out has a σ of at most 0.3 px, beside 1.4 px by diffraction: 2 % of its width.
"""
MIRROR_STEP_PX = 3.0
OBJECT_STEP_PX = 4.0
"""Largest motion per rendered picture of an exposure; objects move evenly, less blur is lost in the PSF."""
EVEN_PX = 4.0
"""An object whose parts in view move alike to within this is blurred along one line: at either end of the
exposure a part is off by a quarter of it at most."""
STEPS_MAX = 6
MOTION_SAMPLES = 9


class World:
    """Mirrors, optics, scene and faults; every method may be called from any thread."""

    def __init__(
        self,
        *,
        scene: AnimatedScene,
        preset: RigPreset,
        seed: int,
        clock: Clock,
        assembly: SimulatedAssembly | None = None,
    ) -> None:
        self.animated_scene = scene
        self.preset = preset
        self.seed = seed
        self.assembly = assembly = assembly or SimulatedAssembly()
        self.faults = WorldFaults()
        self.drift = ThermalMountDrift(seed=seed)
        self.lens = WideLens()
        self.t0_ns = clock.now_ns()
        self.eyes = {role: FoldedEye(_moved(built_assembly(role, seed=seed), assembly)) for role in EYES}
        self.mirrors = MirrorPair(mode=preset.mode, cutoff_hz=preset.low_pass_hz, t_ns=self.t0_ns, seed=seed)
        self.mirrors.drive_scale = assembly.drive_scale
        self.pedestal = Pedestal(seed=seed)
        self._motor_motion = TurningHistory()
        self.manual_motion = TurningHistory()
        """Turns of the rig by hand, added to those of the motors."""
        self.advance_motors: Callable[[int], None] = _advance_nothing
        """Advances the motors' firmware to a time, where it runs in this process."""
        scene.rig_pose = self._rig_pose
        self.on_codes: Callable[[int, DacCodes], None] = _ignore_codes
        """Called with each update of the DACs and its time at the controller; for benches."""
        self._shutters: dict[Role, ShutterPort] = {}
        self._mirror_lock = threading.Lock()
        self._wide = wide_projections(self.lens)

    # Cables, called by the far ends

    def set_codes(self, t_ns: int, codes: DacCodes) -> None:
        """Set the 8 DAC codes from `t_ns` on."""
        self.on_codes(t_ns, codes)
        with self._mirror_lock:
            self.mirrors.dead_axes = self.faults.dead_axes
            self.mirrors.set_codes(t_ns, wired_codes(codes, self.assembly))

    def set_rail(self, t_ns: int, *, on: bool) -> None:
        """Switch the mirrors' high voltage."""
        with self._mirror_lock:
            self.mirrors.set_rail(t_ns, on=on)

    def set_low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        """Set the cut-off of the drive filters; 0 stops their clock."""
        with self._mirror_lock:
            self.mirrors.set_low_pass(t_ns, round(cutoff_hz * self.assembly.filter_scale))

    def trigger(self, t_ns: int, *, pulse_us: int, cameras: int) -> None:
        """Pass a rising edge to every camera in the mask, for a pulse of any length above 0."""
        for bit, role in CAMERA_ROLES.items():
            shutter = self._shutters.get(role)
            if cameras & bit and pulse_us > 0 and shutter and role not in self.faults.no_trigger:
                shutter.trigger(t_ns)

    def strobe_us(self, role: Role) -> int | None:
        """Return the length of the strobe pulse that a trigger now would cause; None without a strobe."""
        broken = self.faults.no_strobe | self.faults.no_trigger | self.faults.unplugged
        shutter = self._shutters.get(role)
        return None if shutter is None or role in broken else shutter.strobe_us()

    def add_segment(self, segment: TurnSegment) -> None:
        """Move the pan-tilt and the rail by `segment` from its `t_ns` on."""
        self._motor_motion.add_segment(segment)

    def connect_shutter(self, role: Role, shutter: ShutterPort) -> None:
        """Connect a camera's trigger and strobe lines."""
        self._shutters[role] = shutter

    # Views of the cameras

    def projection(self, role: Role, t_ns: int, *, binning: Binning = 1) -> Projection:
        """Return the projection of a camera at `t_ns` to the pixels of its frames at a binning."""
        if role is Role.WIDE:
            return self._wide[binning]
        return self._eye_projection(role, self._tilts_rad(role, (t_ns,))[0], t_ns, binning)

    def radiance(
        self, role: Role, interval: ExposureInterval, *, channels: int, binning: Binning = 1
    ) -> NDArray[np.float32]:
        """Return the mean radiance over an exposure, (h, w) or (h, w, 3) float32, 0..1, at a binning.

        It is rendered once, for its middle and the mean tilt of the mirror, unless mirror, rig or an object
        moves noticeably.
        """
        scene, middle_s = self.animated_scene, self.scene_s(interval.middle_ns)
        middle, swing_px = self._mean_view(role, interval, binning)
        motion = scene.motion(middle, self.scene_s(interval.start_ns), self.scene_s(interval.end_ns))
        moved_px = binning * motion.largest_px
        if swing_px <= SETTLED_PX:
            if moved_px <= OBJECT_STEP_PX:
                return scene.radiance(middle, middle_s, channels=channels)
            shifts_px = None if middle.rays else motion.even_shifts(EVEN_PX / binning)
            if shifts_px is not None:
                return scene.blurred(middle, middle_s, shifts_px, channels=channels)
        views = (
            (self.projection(role, t_ns, binning=binning), self.scene_s(t_ns))
            for t_ns in interval.middles_ns(_pictures(moved_px, swing_px=swing_px))
        )
        return _mean(scene.radiance(view, t_s, channels=channels) for view, t_s in views)

    def scene_s(self, t_ns: int) -> float:
        """Return the scene time of `t_ns`: seconds since the world was made."""
        return (t_ns - self.t0_ns) * 1e-9

    def static_view(self, role: Role, volts: MirrorVolts, *, t_ns: int | None = None) -> EyeProjection:
        """Return an eye's projection with its mirror at rest, with the drift at `t_ns` or none (truth).

        It follows the mirror's static law; a disturbance of the mirrors is in `projection` alone.
        """
        tilt_rad = self.mirrors.rest_tilt_rad(role, volts)
        return self.eyes[role].view(*tilt_rad) if t_ns is None else self._eye_view(role, tilt_rad, t_ns)

    def bearing_deg(self, t_ns: int) -> tuple[float, float]:
        """Return the rig's (pan, tilt), degrees: turns by motors and by hand together."""
        self.advance_motors(t_ns)
        by_motors, by_hand = self._motor_motion.bearing_deg(t_ns), self.manual_motion.bearing_deg(t_ns)
        return by_motors[0] + by_hand[0], by_motors[1] + by_hand[1]

    def slide_mm(self, t_ns: int) -> float:
        """Return the rig's position on the rail, mm, > 0 to its right."""
        self.advance_motors(t_ns)
        return self._motor_motion.slide_mm(t_ns)[0]

    def rig_from_world(self, t_ns: int) -> NDArray[np.float64]:
        """Return rig_from_world (4, 4): the identity while pan-tilt and rail are at 0."""
        return self.pedestal.rig_from_world(*self.bearing_deg(t_ns), self.slide_mm(t_ns))

    def _rig_pose(self, t_s: float) -> NDArray[np.float64] | None:
        t_ns = self.t0_ns + round(t_s * 1e9)
        bearing_deg, slide_mm = self.bearing_deg(t_ns), self.slide_mm(t_ns)
        if bearing_deg == (0.0, 0.0) and slide_mm == 0.0:
            return None
        return self.pedestal.rig_from_world(*bearing_deg, slide_mm)

    def _mean_view(
        self, role: Role, interval: ExposureInterval, binning: Binning
    ) -> tuple[Projection, float]:
        """Return the projection at the mean tilt of an exposure, and how far the image swings in it, px."""
        if role is Role.WIDE:
            return self._wide[binning], 0.0
        tilts_rad = self._tilts_rad(role, interval.middles_ns(MOTION_SAMPLES))
        swing_px = 2.0 * FOVEA_FOCAL_PX * float(np.max(np.ptp(tilts_rad, axis=0)))
        mean_rad = _rounded(tilts_rad.mean(axis=0))
        return self._eye_projection(role, mean_rad, interval.middle_ns, binning), swing_px

    def _eye_projection(
        self, role: Role, tilt_rad: NDArray[np.float64], t_ns: int, binning: Binning
    ) -> Projection:
        x_rad, y_rad = tilt_rad.tolist()
        eye = renderer_projection(self._eye_view(role, (x_rad, y_rad), t_ns))
        return eye if binning == 1 else eye.halved()

    def _tilts_rad(self, role: Role, times_ns: Sequence[int]) -> NDArray[np.float64]:
        """Return a mirror's tilts (n, 2) at several times, rounded."""
        with self._mirror_lock:
            self.mirrors.dead_axes = self.faults.dead_axes
            tilts_rad = self.mirrors.tilts_rad(role, times_ns)
        return _rounded(tilts_rad)

    def _eye_view(self, role: Role, tilt_rad: tuple[float, float], t_ns: int) -> EyeProjection:
        turn_rad = np.array(self.faults.drift_step_rad.get(role, (0.0, 0.0, 0.0)))
        turn_rad[:2] += self.drift.turn_rad(role, self.scene_s(t_ns))
        turn_rad += mount_turn_rad(self.assembly.eye(role), role, t_ns - self.t0_ns)
        mount_rad = np.round(turn_rad / MOUNT_STEP_RAD) * MOUNT_STEP_RAD
        return self.eyes[role].view(*tilt_rad, mount_turn_rad=mount_rad)


def _moved(eye: EyeAssembly, assembly: SimulatedAssembly) -> EyeAssembly:
    x_m, y_m, z_m = eye.pivot_m
    return replace(eye, pivot_m=(x_m * assembly.baseline_scale, y_m, z_m))


def _rounded(tilts_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.round(tilts_rad / TILT_STEP_RAD) * TILT_STEP_RAD, dtype=np.float64)


def _mean(pictures: Iterator[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Return the mean of pictures, taken one by one; a single one is the renderer's own, not a copy."""
    total, count = next(pictures), 1
    for picture in pictures:
        total, count = total + picture, count + 1
    return total if count == 1 else total / np.float32(count)


def _pictures(moved_px: float, *, swing_px: float) -> int:
    """Return the number of pictures averaged in an exposure; lengths in px of the sensor."""
    count = max(1, int(np.ceil(moved_px / OBJECT_STEP_PX)))
    if swing_px > SETTLED_PX:
        count = max(count, 1 + int(np.ceil(swing_px / MIRROR_STEP_PX)))
    return min(STEPS_MAX, count)


def _advance_nothing(t_ns: int) -> None:
    """Do nothing: the motors' own process reports their motion in time."""


def _ignore_codes(t_ns: int, codes: DacCodes) -> None:
    """Do nothing: no bench listens."""


def renderer_projection(view: EyeProjection) -> Projection:
    """Return an eye's projection for the renderer."""
    return Projection(M=view.matrix, C=view.centre_m, width=FOVEA_WIDTH, height=FOVEA_HEIGHT, rays=None)
