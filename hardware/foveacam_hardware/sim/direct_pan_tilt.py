"""A stand-in for the pan-tilt's driver and far end: turns the world without a wire."""

import math

from foveacam_hardware.contract import (
    Clock,
    DeviceFault,
    DeviceInfo,
    OutOfRange,
    PanTiltLimits,
    PanTiltPose,
    PanTiltState,
)
from foveacam_hardware.sim.pan_tilt import Turning
from foveacam_hardware.sim.world import World

LIMITS = PanTiltLimits(
    pan_min_rad=math.radians(-70),
    pan_max_rad=math.radians(70),
    tilt_min_rad=math.radians(-30),
    tilt_max_rad=math.radians(30),
)
SPEED_DEG_S, ACCELERATION_DEG_S2 = 25.0, 100.0


class DirectPanTilt:
    """Turns the world at once, in time."""

    def __init__(self, world: World, clock: Clock) -> None:
        self._world = world
        self._clock = clock
        self._connected = False
        self._homed = False
        self._goal = (0.0, 0.0)
        self._done_ns = 0

    info = DeviceInfo(vendor="FoveaCam", model="simulated pan-tilt", serial="simulated")
    limits = LIMITS
    moves_itself = True

    @property
    def state(self) -> PanTiltState:
        """Connected, moving, where."""
        if not self._connected:
            return PanTiltState(connected=False)
        now_ns = self._clock.now_ns()
        pan, tilt = self._world.bearing_deg(now_ns)
        pose = PanTiltPose(pan_rad=math.radians(pan), tilt_rad=math.radians(tilt)) if self._homed else None
        return PanTiltState(connected=True, moving=now_ns < self._done_ns, homed=self._homed, pose=pose)

    def connect(self) -> None:
        """Connect."""
        self._connected = True

    def close(self) -> None:
        """Close."""
        if self._connected:
            self.hold()
        self._connected = False

    def home(self) -> None:
        """Home, ending at 0/0."""
        self._homed = True
        self._move((0.0, 0.0))

    def move_to(self, pose: PanTiltPose) -> None:
        """Move."""
        if not self._homed:
            raise DeviceFault("pan-tilt: asked to move, but it does not know where it stands; home it first")
        pan, tilt = math.degrees(pose.pan_rad), math.degrees(pose.tilt_rad)
        if not (abs(pan) <= 70.0001 and abs(tilt) <= 30.0001):
            raise OutOfRange(
                f"pan-tilt: pan {pan:.2f}, tilt {tilt:.2f} deg is outside +-70 and +-30; choose a pose inside"
            )
        self._move((round(pan, 2), round(tilt, 2)))

    def hold(self) -> None:
        """Stop."""
        now_ns = self._clock.now_ns()
        self._world.turn(Turning(t_ns=now_ns, place_deg=self._world.bearing_deg(now_ns)))
        self._done_ns = now_ns

    def _move(self, goal: tuple[float, float]) -> None:
        now_ns = self._clock.now_ns()
        start = self._world.bearing_deg(now_ns)
        far = max(abs(b - a) for a, b in zip(start, goal, strict=True))
        if far == 0.0:
            return
        ramp_s = min(SPEED_DEG_S / ACCELERATION_DEG_S2, math.sqrt(far / ACCELERATION_DEG_S2))
        top = ramp_s * ACCELERATION_DEG_S2
        even_s = far / top - ramp_s
        unit = [(b - a) / far for a, b in zip(start, goal, strict=True)]
        t_ns, place, speed = now_ns, start, 0.0
        for acceleration, length_s in (
            (ACCELERATION_DEG_S2, ramp_s),
            (0.0, even_s),
            (-ACCELERATION_DEG_S2, ramp_s),
        ):
            turning = Turning(
                t_ns=t_ns,
                place_deg=place,
                speed_deg_s=(unit[0] * speed, unit[1] * speed),
                acceleration_deg_s2=(unit[0] * acceleration, unit[1] * acceleration),
            )
            self._world.turn(turning)
            t_ns += round(length_s * 1e9)
            place, speed = turning.place_at(t_ns), speed + acceleration * length_s
        self._world.turn(Turning(t_ns=t_ns, place_deg=goal))
        self._done_ns = t_ns
