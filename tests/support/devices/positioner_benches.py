"""Pan-tilts and rails to run the positioners' contract on: manual, on a simulated board, behind a port."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

from foveacam_hardware.contract import (
    Clock,
    PanTiltState,
    RailLimits,
    RailState,
)
from foveacam_hardware.drivers.positioners.grbl import GrblPanTilt
from foveacam_hardware.drivers.positioners.grbl_axes import GrblMounting
from foveacam_hardware.drivers.positioners.grbl_rail import GrblRail, GrblRailMounting
from foveacam_hardware.drivers.positioners.manual import ManualPanTilt, ManualRail
from foveacam_hardware.drivers.positioners.ptu import PtuPanTilt
from foveacam_hardware.drivers.positioners.ptu_axes import PtuMounting
from foveacam_hardware.sim.far_ends.board_far_end import BoardFaults, BoardKind
from foveacam_hardware.sim.far_ends.board_loopback import BoardLoopback
from foveacam_hardware.sim.far_ends.board_process import BoardProcess
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.far_ends.grbl_firmware import RAIL_SWITCH_MM
from foveacam_hardware.sim.far_ends.ptu_far_end import PtuFarEnd
from foveacam_hardware.sim.pan_tilt import TurningHistory, TurnSegment
from tests.support.devices.pan_tilt_boards import GRBL_STEP_DEG, PTU_STEP_DEG, bearing, reach

POLL_NS = 10_000_000
PATIENCE_NS = 30_000_000_000
RAIL_STEP_MM = 0.01
FAST_GRBL: BoardFaults = {"settings": dict.fromkeys((24, 25, 110, 111, 112, 120, 121, 122), 1e6)}
FAST_PTU: BoardFaults = {"steps_per_s": 2_000_000, "slow_ns": -8_000_000}
"""Fast motors (and a fast unit) for tests in real time: homing takes a tenth of a second."""
SLOW_GRBL: BoardFaults = {"settings": {110: 600.0, 111: 600.0, 112: 6_000.0}}
SLOW_PTU: BoardFaults = {"steps_per_s": 200}
"""Motors that take seconds for a move: slow enough to be stopped on their way by a busy machine."""
SPEED_RAD_S = math.radians(10_000.0)

Position: TypeAlias = tuple[float, ...]
"""Pan and tilt, deg; or the rail's position, mm."""
Device: TypeAlias = ManualPanTilt | GrblPanTilt | PtuPanTilt | ManualRail | GrblRail
Board: TypeAlias = BoardLoopback[GrblFarEnd] | BoardLoopback[PtuFarEnd] | BoardProcess


@dataclass(kw_only=True)
class PositionerBench:
    """A positioner, the rig that it moves, and positions to move it to."""

    device: Device
    clock: Clock
    rig: TurningHistory
    """Holds the true pose of the rig."""
    zero: Position
    near: Position
    far: Position
    """Far enough to be stopped on the way there."""
    limits: tuple[Position, Position]
    outside: tuple[Position, ...]
    refusal: str = "outside"
    """What the refusal of a position outside says."""
    step: float = 0.0
    """Resolution of its motors, deg or mm."""
    slow_down: Callable[[], object] = field(default=lambda: None)
    deliver: Callable[[], object] = field(default=lambda: None)
    """Waits until the rig has received every movement so far."""

    def move_to(self, position: Position) -> None:
        if isinstance(self.device, ManualRail | GrblRail):
            self.device.move_to(1e-3 * position[0])
        else:
            self.device.move_to(bearing(*position))

    @property
    def wanted(self) -> Position | None:
        """The position that a person was asked to bring it to."""
        if isinstance(self.device, ManualRail):
            return None if self.device.wanted_m is None else (1e3 * self.device.wanted_m,)
        assert isinstance(self.device, ManualPanTilt)
        wanted = self.device.wanted
        return None if wanted is None else (math.degrees(wanted.pan_rad), math.degrees(wanted.tilt_rad))

    @property
    def true_position(self) -> Position:
        self.deliver()
        t_ns = self.clock.now_ns()
        if isinstance(self.device, ManualRail | GrblRail):
            return (self.rig.slide_mm(t_ns)[0],)
        return self.rig.bearing_deg(t_ns)

    def wait_for_rest(self) -> PanTiltState | RailState:
        end_ns = self.clock.now_ns() + PATIENCE_NS
        while (state := self.device.state).moving:
            assert self.clock.now_ns() < end_ns
            self.clock.sleep_until_ns(self.clock.now_ns() + POLL_NS)
        return state

    def home(self) -> "PositionerBench":
        self.device.connect()
        self.device.home()
        assert self.wait_for_rest().fault is None
        return self


def reported_position(state: PanTiltState | RailState) -> Position | None:
    if isinstance(state, RailState):
        return None if state.position_m is None else (1e3 * state.position_m,)
    return (
        None if state.pose is None else (math.degrees(state.pose.pan_rad), math.degrees(state.pose.tilt_rad))
    )


pan_tilt_bench = partial(
    PositionerBench,
    zero=(0.0, 0.0),
    near=(12.3, -7.5),
    far=(60.0, 20.0),
    outside=((180.1, 0.0), (0.0, 90.1), (-181.0, 0.0), (0.0, -91.0)),
)
rail_bench = partial(
    PositionerBench,
    zero=(0.0,),
    near=(-100.0,),
    far=(300.0,),
    limits=((-300.0,), (300.0,)),
    outside=((301.0,), (-301.0,), (5000.0,), (math.nan,), (math.inf,)),
    refusal="outside -300 to 300 mm; choose",
)
RAIL_LIMITS = RailLimits(min_m=-0.3, max_m=0.3)
PAN_TILT_LIMITS = ((-70.0, -30.0), (70.0, 30.0))


def manual_pan_tilt(clock: Clock, rig: TurningHistory) -> PositionerBench:
    return pan_tilt_bench(device=ManualPanTilt(), clock=clock, rig=rig, limits=PAN_TILT_LIMITS)


def manual_rail(clock: Clock, rig: TurningHistory) -> PositionerBench:
    return rail_bench(device=ManualRail(limits=RAIL_LIMITS), clock=clock, rig=rig)


def grbl_pan_tilt(board: Board, clock: Clock, rig: TurningHistory) -> PositionerBench:
    board.set_faults(**FAST_GRBL)
    mounting = GrblMounting(zero=bearing(72.0, 32.0), speed_rad_s=SPEED_RAD_S)
    return pan_tilt_bench(
        device=GrblPanTilt(board.open, clock, limits=reach(), mounting=mounting),
        clock=clock,
        rig=rig,
        limits=PAN_TILT_LIMITS,
        step=GRBL_STEP_DEG,
        slow_down=lambda: board.set_faults(**SLOW_GRBL),
    )


def ptu_pan_tilt(board: Board, clock: Clock, rig: TurningHistory) -> PositionerBench:
    board.set_faults(**FAST_PTU)
    mounting = PtuMounting(speed_rad_s=SPEED_RAD_S)
    return pan_tilt_bench(
        device=PtuPanTilt(board.open, clock, limits=reach(), mounting=mounting),
        clock=clock,
        rig=rig,
        limits=PAN_TILT_LIMITS,
        step=PTU_STEP_DEG,
        slow_down=lambda: board.set_faults(**SLOW_PTU),
    )


def grbl_rail(board: Board, clock: Clock, rig: TurningHistory) -> PositionerBench:
    board.set_faults(**FAST_GRBL)
    mounting = GrblRailMounting(zero_m=1e-3 * RAIL_SWITCH_MM, speed_m_s=16.0)
    return rail_bench(
        device=GrblRail(board.open, clock, limits=RAIL_LIMITS, mounting=mounting),
        clock=clock,
        rig=rig,
        step=RAIL_STEP_MM,
        slow_down=lambda: board.set_faults(**SLOW_GRBL),
    )


class SharedShafts:
    """Pass motor movements of a shared board process to the rig of the running test."""

    def __init__(self) -> None:
        self.rig = TurningHistory()

    def add_segment(self, segment: TurnSegment) -> None:
        self.rig.add_segment(segment)


@contextmanager
def board_process(kind: BoardKind) -> Iterator[tuple[BoardProcess, SharedShafts]]:
    shafts = SharedShafts()
    with BoardProcess(kind, shafts) as process:
        process.open().close()  # it is up
        yield process, shafts
