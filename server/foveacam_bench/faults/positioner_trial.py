"""One pan-tilt or rail on virtual time, with everything that can happen to it as a step.

After each step the driver's state is compared with the truth: whenever it says homed, its position is the
true one. The bench takes random steps; the tests let hypothesis choose them.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from foveacam_bench.faults.trial_checks import FalsePosition, require
from foveacam_hardware.contract import (
    FoveaError,
    PanTiltLimits,
    PanTiltPose,
    PanTiltState,
    RailLimits,
    RailState,
    VirtualClock,
)
from foveacam_hardware.drivers.positioners.grbl import GrblPanTilt
from foveacam_hardware.drivers.positioners.grbl_axes import GrblMounting
from foveacam_hardware.drivers.positioners.grbl_rail import GrblRail, GrblRailMounting
from foveacam_hardware.drivers.positioners.ptu import PtuPanTilt
from foveacam_hardware.drivers.positioners.ptu_axes import PtuMounting
from foveacam_hardware.sim.far_ends.board_loopback import BoardLoopback
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.far_ends.grbl_firmware import RAIL_SWITCH_MM, SWITCHES_DEG
from foveacam_hardware.sim.far_ends.ptu_far_end import PtuFarEnd
from foveacam_hardware.sim.pan_tilt import ZERO_POSITIONS, TurningHistory

POLL_S = 0.2
LAST_WORD_S = 6.0
"""Longest silence of a board that counts as connected, unless it is homing."""
HOMING_LAST_WORD_S = 100.0
CONNECT_PAUSE_S = 12.0
"""Longer than the pause before the next connect to a board that did not answer the last one."""
REST_S = 100.0
STEP = 0.015
"""Tolerance at rest: a motor step, deg or mm."""
TOP_SPEED = 150.0
"""Faster than any axis, deg/s or mm/s: what may change while the driver reads."""
LIMITS = PanTiltLimits(pan_min_rad=-1.2, pan_max_rad=1.2, tilt_min_rad=-0.5, tilt_max_rad=0.5)
RAIL_LIMITS = RailLimits(min_m=-0.3, max_m=0.3)
SPEED_PER_S = 100.0
MOTORS = {24: 6e3, 25: 6e3, 110: 6e3, 111: 6e3, 112: 6e3, 120: 1e3, 121: 1e3, 122: 1e3}
"""Settings of a Grbl board with fast motors: a whole turn takes a second and a half."""
PTU_STEPS_PER_S = 50_000
WITHOUT_SWITCHES = {20: 0.0, 22: 0.0}

Position = tuple[float, ...]
"""Pan and tilt, deg; or the rail's position, mm."""


@dataclass(frozen=True, kw_only=True)
class TrialKind:
    """A device under trial."""

    name: str
    is_rail: bool = False
    is_ptu: bool = False
    has_switches: bool = True


KINDS = (
    TrialKind(name="grbl"),
    TrialKind(name="grbl without switches", has_switches=False),
    TrialKind(name="rail", is_rail=True),
    TrialKind(name="rail without switches", is_rail=True, has_switches=False),
    TrialKind(name="ptu", is_ptu=True),
)


class PositionerTrial:
    """A device, its far end and the truth; every public method but `check` and `recover` is a step."""

    def __init__(self, kind: TrialKind) -> None:
        self.kind = kind
        self.clock = VirtualClock(1_000_000_000)
        self._rig = TurningHistory()
        self._far_end: GrblFarEnd | PtuFarEnd
        if kind.is_ptu:
            self._far_end = PtuFarEnd(self.clock, self._rig)
        else:
            self._far_end = GrblFarEnd(self.clock, self._rig, has_rail=kind.is_rail)
        self._board = BoardLoopback(self._far_end, self.clock)
        self._device = self._make_device()
        self._silent_since_ns: int | None = None

    def connect(self) -> None:
        """Connect, as the server does every few seconds."""
        with suppress(FoveaError):
            self._device.connect()

    def close(self) -> None:
        """Close the device."""
        self._device.close()

    def home(self) -> None:
        """Home it."""
        with suppress(FoveaError):
            self._device.home()

    def hold(self) -> None:
        """Hold it, as the stop does."""
        with suppress(FoveaError):
            self._device.hold()

    def move(self, share: float) -> None:
        """Move to a share of its range, -1 to 1."""
        with suppress(FoveaError):
            if isinstance(self._device, GrblRail):
                self._device.move_to(share * RAIL_LIMITS.max_m)
            else:
                pan_rad, tilt_rad = share * LIMITS.pan_max_rad, -share * LIMITS.tilt_max_rad
                self._device.move_to(PanTiltPose(pan_rad=pan_rad, tilt_rad=tilt_rad))

    def confirm_zero(self) -> None:
        """Push it to its zero if it awaits that, and confirm; else confirm only if it is at its zero."""
        far_end, moves = self._far_end, self._far_end_moves()
        if self._device.state.awaits_zero and isinstance(far_end, GrblFarEnd) and not moves:
            far_end.firmware.push_by_hand(self.clock.now_ns(), ZERO_POSITIONS)
        elif max(map(abs, self._true_position())) > STEP or moves:
            return
        with suppress(FoveaError):
            self._device.confirm_zero()

    def wait(self, wait_s: float) -> None:
        """Let time pass while its state is read."""
        end_ns = self.clock.now_ns() + round(wait_s * 1e9)
        while self.clock.now_ns() < end_ns:
            self._sleep(min(POLL_S, (end_ns - self.clock.now_ns()) / 1e9))
            self.check()

    def look_away(self, wait_s: float) -> None:
        """Let time pass without reading its state."""
        self._sleep(wait_s)

    def silence(self) -> None:
        """Make the board silent: it ignores its input and sends nothing."""
        self._board.set_faults(silent=True)
        if self._silent_since_ns is None:
            self._silent_since_ns = self.clock.now_ns()

    def end_silence(self) -> None:
        """Make the board respond again."""
        self._board.set_faults(silent=False)
        self._silent_since_ns = None

    def lose_power(self) -> None:
        """Switch the board's supply off and on, wherever the axes are and whether it is responsive or not."""
        self._board.power_cycle()

    def lose_power_unheard(self) -> None:
        """Switch its supply off and on; its greeting gets lost."""
        self._board.set_faults(silent=True)
        self._board.power_cycle()
        self._board.set_faults(silent=self._silent_since_ns is not None)

    def unplug(self) -> None:
        """Pull its cable."""
        self._board.unplug()

    def plug(self) -> None:
        """Plug its cable in again."""
        if self._far_end.unplugged:
            self._board.plug()

    def hit_a_limit(self) -> None:
        """Let an axis run into its limit."""
        self._board.hit_a_limit()

    def hold_at_the_board(self) -> None:
        """Let a person hold a Grbl board by its own button."""
        if not self.kind.is_ptu:
            self._far_end.feed(b"!")

    def release_at_the_board(self) -> None:
        """Let the person release it."""
        if not self.kind.is_ptu:
            self._far_end.feed(b"~")

    def reset_by_another_program(self) -> None:
        """Let another program reset the board, or a FLIR unit's motion halt."""
        self._far_end.feed(b"H " if self.kind.is_ptu else b"\x18")

    def check(self) -> None:
        """Compare the driver's state with the truth; raise `TrialFailed` or `FalsePosition`."""
        began_ns = self.clock.now_ns()
        state = self._device.state
        position = _position_of(state)
        require(state.connected or not (state.homed or state.moving or state.awaits_zero), state)
        require(state.homed or position is None, state)
        require(not (state.awaits_zero and (self.kind.has_switches or state.homed)), state)
        if self._silent_since_ns is not None and state.connected:
            silent_s = (began_ns - self._silent_since_ns) / 1e9
            longest_s = HOMING_LAST_WORD_S if state.moving else LAST_WORD_S
            require(silent_s < longest_s, f"connected after {silent_s:.1f} s of silence: {state}")
        if position is not None:
            allowed = STEP + TOP_SPEED * (self.clock.now_ns() - began_ns) / 1e9
            truth = self._true_position()
            if max(abs(reported - true) for reported, true in zip(position, truth, strict=True)) > allowed:
                raise FalsePosition(f"{self.kind.name}: it reports {position}, and stands at {truth}")

    def recover(self) -> None:
        """Repair everything, and do what the states ask for, once: it must be usable afterwards."""
        self.end_silence()
        self.plug()
        self.release_at_the_board()
        self.wait(CONNECT_PAUSE_S)
        if not self._device.state.connected:
            self._device.connect()
        self._rest()
        if self.kind.has_switches:
            self._device.home()
        elif not self._device.state.homed:
            self.lose_power()
            self.wait(1.0)
            self.confirm_zero()
        require(self._rest().homed, f"{self.kind.name}: it has all it needs: {self._device.state}")
        self.move(0.5)
        state = self._rest()
        require(state.fault is None and state.homed, state)
        require(abs(self._true_position()[0]) > 1.0, "it was moved and stands at its zero")

    def _rest(self) -> PanTiltState | RailState:
        end_ns = self.clock.now_ns() + round(REST_S * 1e9)
        while (state := self._device.state).moving:
            require(self.clock.now_ns() < end_ns, f"it never came to rest: {state}")
            self._sleep(POLL_S)
        self.check()
        return state

    def _true_position(self) -> Position:
        t_ns = self.clock.now_ns()
        return self._rig.slide_mm(t_ns)[:1] if self.kind.is_rail else self._rig.bearing_deg(t_ns)

    def _far_end_moves(self) -> bool:
        t_ns = self.clock.now_ns()
        return any(self._rig.speed_deg_s(t_ns)) or bool(self._rig.slide_mm(t_ns)[1])

    def _sleep(self, wait_s: float) -> None:
        self.clock.sleep_until_ns(self.clock.now_ns() + round(wait_s * 1e9))
        self._board.advance(self.clock.now_ns())

    def _make_device(self) -> GrblPanTilt | GrblRail | PtuPanTilt:
        kind, board, clock = self.kind, self._board, self.clock
        if kind.is_ptu:
            board.set_faults(steps_per_s=PTU_STEPS_PER_S)
            return PtuPanTilt(
                board.open,
                clock,
                limits=LIMITS,
                mounting=PtuMounting(speed_rad_s=math.radians(SPEED_PER_S)),
            )
        board.set_faults(settings=MOTORS if kind.has_switches else MOTORS | WITHOUT_SWITCHES)
        board.power_cycle()
        if kind.is_rail:
            return GrblRail(
                board.open,
                clock,
                limits=RAIL_LIMITS,
                mounting=GrblRailMounting(
                    zero_m=1e-3 * RAIL_SWITCH_MM if kind.has_switches else 0.0,
                    speed_m_s=1e-3 * SPEED_PER_S,
                    has_switches=kind.has_switches,
                ),
            )
        pan_deg, tilt_deg = SWITCHES_DEG if kind.has_switches else (0.0, 0.0)
        return GrblPanTilt(
            board.open,
            clock,
            limits=LIMITS,
            mounting=GrblMounting(
                zero=PanTiltPose(pan_rad=math.radians(pan_deg), tilt_rad=math.radians(tilt_deg)),
                speed_rad_s=math.radians(SPEED_PER_S),
                has_switches=kind.has_switches,
            ),
        )


STEPS: tuple[Callable[[PositionerTrial], None], ...] = (
    PositionerTrial.connect,
    PositionerTrial.home,
    PositionerTrial.hold,
    PositionerTrial.confirm_zero,
    PositionerTrial.close,
    PositionerTrial.silence,
    PositionerTrial.end_silence,
    PositionerTrial.lose_power,
    PositionerTrial.lose_power_unheard,
    PositionerTrial.unplug,
    PositionerTrial.plug,
    PositionerTrial.hit_a_limit,
    PositionerTrial.hold_at_the_board,
    PositionerTrial.release_at_the_board,
    PositionerTrial.reset_by_another_program,
)
"""Steps without an argument."""
WAITS_S = (0.05, 0.3, 0.6, 1.5, 5.0)


def _position_of(state: PanTiltState | RailState) -> Position | None:
    if isinstance(state, RailState):
        return None if state.position_m is None else (1e3 * state.position_m,)
    return (
        None if state.pose is None else (math.degrees(state.pose.pan_rad), math.degrees(state.pose.tilt_rad))
    )
