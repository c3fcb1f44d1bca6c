"""Pan-tilts whose boards are in this process, on virtual time: what their fault tests share."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from foveacam_hardware.contract import PanTilt, PanTiltLimits, PanTiltPose, PanTiltState, VirtualClock
from foveacam_hardware.drivers.positioners.grbl import GrblPanTilt
from foveacam_hardware.drivers.positioners.grbl_axes import GrblMounting
from foveacam_hardware.drivers.positioners.ptu import PtuPanTilt
from foveacam_hardware.drivers.positioners.ptu_axes import PtuMounting
from foveacam_hardware.sim.far_ends.board_far_end import BoardFarEnd, BoardFaults
from foveacam_hardware.sim.far_ends.board_loopback import BoardLoopback
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.far_ends.ptu_far_end import PtuFarEnd
from foveacam_hardware.sim.far_ends.ptu_firmware import ARC_SECONDS_PER_STEP
from foveacam_hardware.sim.pan_tilt import TurningHistory

POLL_NS = 20_000_000
GRBL_STEP_DEG = 0.01
PTU_STEP_DEG = ARC_SECONDS_PER_STEP / 3600.0


def bearing(pan_deg: float, tilt_deg: float) -> PanTiltPose:
    return PanTiltPose(pan_rad=math.radians(pan_deg), tilt_rad=math.radians(tilt_deg))


def reach(pan_deg: float = 70.0, tilt_deg: float = 30.0) -> PanTiltLimits:
    low, high = bearing(-pan_deg, -tilt_deg), bearing(pan_deg, tilt_deg)
    return PanTiltLimits(
        pan_min_rad=low.pan_rad,
        pan_max_rad=high.pan_rad,
        tilt_min_rad=low.tilt_rad,
        tilt_max_rad=high.tilt_rad,
    )


@dataclass
class Bench:
    """A board, the rig that it turns, and its driver."""

    clock: VirtualClock
    rig: TurningHistory
    board: BoardLoopback[BoardFarEnd]
    driver: PanTilt
    step_deg: float

    def wait(self, wait_s: float) -> PanTiltState:
        """Look on for a while, as a procedure does."""
        end_ns = self.clock.now_ns() + round(wait_s * 1e9)
        while self.clock.now_ns() < end_ns:
            self.clock.sleep_until_ns(min(end_ns, self.clock.now_ns() + POLL_NS))
            state = self.driver.state
        return state

    def rest(self) -> PanTiltState:
        for _ in range(10_000):
            if not (state := self.driver.state).moving:
                return state
            self.clock.sleep_until_ns(self.clock.now_ns() + POLL_NS)
        raise AssertionError("it never came to rest")

    def homed(self) -> "Bench":
        self.driver.connect()
        self.driver.home()
        self.rest()
        return self

    @property
    def place_deg(self) -> tuple[float, float]:
        return self.rig.bearing_deg(self.clock.now_ns())

    def stands_at(self, pan_deg: float, tilt_deg: float, *, near_deg: float | None = None) -> bool:
        """Tell whether the rig really points there, to the nearest step unless told otherwise."""
        near_deg = 0.51 * self.step_deg if near_deg is None else near_deg
        at_deg = self.place_deg
        return max(abs(at_deg[0] - pan_deg), abs(at_deg[1] - tilt_deg)) <= near_deg


def grbl_bench(*, zero_deg: tuple[float, float] = (72.0, 32.0), has_switches: bool = True) -> Bench:
    clock, rig = VirtualClock(1_000_000_000), TurningHistory()
    board: BoardLoopback[BoardFarEnd] = BoardLoopback(GrblFarEnd(clock, rig), clock)
    mounting = GrblMounting(zero=bearing(*zero_deg), has_switches=has_switches)
    driver = GrblPanTilt(board.open, clock, limits=reach(), mounting=mounting)
    return Bench(clock, rig, board, driver, GRBL_STEP_DEG)


def ptu_bench(*, mounting: PtuMounting | None = None, limits: PanTiltLimits | None = None) -> Bench:
    clock, rig = VirtualClock(1_000_000_000), TurningHistory()
    board: BoardLoopback[BoardFarEnd] = BoardLoopback(PtuFarEnd(clock, rig), clock)
    driver = PtuPanTilt(board.open, clock, limits=limits or reach(), mounting=mounting)
    return Bench(clock, rig, board, driver, PTU_STEP_DEG)


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A pan-tilt, and in what it differs from the other when something goes wrong."""

    make: Callable[[], Bench]
    homing_s: tuple[float, float]
    """Into it, and the longest."""
    no_homing: BoardFaults
    """What makes homing fail, with `homing_again` undone."""
    homing_again: BoardFaults
    homing_failed: str
    silent_s: float
    """How long until silence is the end of it."""
    no_reply: str
    """What is said of a port where nobody answers."""
    limit: str
    """What is said of a limit that was hit."""
    stop: bytes
    """What another program stops a move with."""
    stopped: str
    """What is said of that."""
    damaged_deg: float = field(default=0.0)
    """How far beside its goal a damaged command may leave it without a word; 0: to the nearest step."""
    refuses_damage: bool = False
    """Whether a damaged command may be refused at once."""


KINDS = {
    "grbl": Kind(
        make=grbl_bench,
        homing_s=(1.0, 11.0),
        no_homing={"has_switches": False},
        homing_again={"has_switches": True},
        homing_failed="a reference switch was not found",
        silent_s=1.0,
        no_reply="nothing that speaks Grbl answers there",
        limit="limit switch was hit",
        stop=b"\x85",
        stopped="stopped on its way",
        damaged_deg=0.051,
    ),
    "ptu": Kind(
        make=ptu_bench,
        homing_s=(2.0, 30.0),
        no_homing={"seized": True},
        homing_again={"seized": False},
        homing_failed="homing failed",
        silent_s=2.0,
        no_reply="no FLIR pan-tilt unit answers there",
        limit="pan ran into a limit",
        stop=b"H ",
        stopped="move it again",
        refuses_damage=True,
    ),
}
