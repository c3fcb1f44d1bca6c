"""The table of what is known of a positioner's position, and the limits that no device is made with."""

import math
from collections.abc import Callable

import pytest

from foveacam_hardware.contract import (
    InvalidInput,
    MirrorLimits,
    OutOfRange,
    PanTiltLimits,
    RailLimits,
    VirtualClock,
)
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.drivers.positioners.grbl_axes import GrblMounting
from foveacam_hardware.drivers.positioners.grbl_rail import GrblRailMounting
from foveacam_hardware.drivers.positioners.life import TRANSITIONS, Event, Phase, PositionerLife
from foveacam_hardware.drivers.positioners.ptu_axes import PtuMounting
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackController

MEASURED = {Event.PROVEN, Event.HOMING_DONE, Event.ZERO_CONFIRMED}
"""The events that make a position known."""


def life_in(phase: Phase, *, has_switches: bool = True) -> PositionerLife:
    life = PositionerLife(has_switches=has_switches)
    life.phase = phase
    return life


def test_a_position_becomes_known_only_by_what_measures_or_proves_it() -> None:
    for event, steps in TRANSITIONS.items():
        for before, after in steps.items():
            if after is Phase.HOMED and before is not Phase.HOMED:
                assert event in MEASURED


@pytest.mark.parametrize("event", [Event.ALARMED, Event.RESTARTED, Event.LINK_LOST])
@pytest.mark.parametrize("has_switches", [True, False])
def test_no_position_outlives_an_alarm_a_restart_or_a_lost_link(event: Event, has_switches: bool) -> None:
    for phase in TRANSITIONS[event]:
        life = life_in(phase, has_switches=has_switches)

        life.apply(event, fault="why")

        assert not life.homed
        assert life.fault == "why"
        assert life.awaits_zero is (life.connected and not has_switches)


def test_whatever_is_connected_can_alarm_restart_be_held_and_be_lost() -> None:
    connected = set(Phase) - {Phase.DISCONNECTED}
    for event in (Event.ALARMED, Event.RESTARTED, Event.HOLD, Event.LINK_LOST):
        assert connected <= set(TRANSITIONS[event])


def test_a_device_without_switches_awaits_its_zero_where_another_is_unknown() -> None:
    for has_switches, phase in ((True, Phase.UNKNOWN), (False, Phase.AWAITS_ZERO)):
        life = PositionerLife(has_switches=has_switches)
        life.apply(Event.CONNECTED)
        assert life.phase is phase


def test_a_homing_that_is_held_is_no_fault_and_leaves_the_position_unknown() -> None:
    life = life_in(Phase.UNKNOWN)
    for event in (Event.HOMING_BEGUN, Event.HOLD, Event.HOMING_FAILED):
        assert life.phase is not Phase.HOMED
        life.apply(event)
    assert (life.phase, life.fault) == (Phase.UNKNOWN, None)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize(
    "make",
    [
        lambda value: MirrorLimits(max_slew_v=value),
        lambda value: MirrorLimits(max_v=value),
        lambda value: MirrorLimits(bias_v=value),
        lambda value: LinkSupervision(answer_s=value),
        lambda value: LinkSupervision(probe_s=value),
        lambda value: LinkSupervision(ceiling_hz=value),
        lambda value: LinkSupervision(least_baseline_ms=value),
        lambda value: GrblMounting(speed_rad_s=value),
        lambda value: GrblRailMounting(speed_m_s=value),
        lambda value: PtuMounting(speed_rad_s=value),
    ],
)
def test_a_rate_limit_or_deadline_is_a_finite_number_above_zero(
    make: Callable[[float], object], value: float
) -> None:
    with pytest.raises(InvalidInput, match=r"is not a finite number above 0; give one"):
        make(value)


@pytest.mark.parametrize(("low", "high"), [(1.0, 1.0), (1.0, 0.0), (math.nan, 1.0), (0.0, math.inf)])
def test_limits_enclose_something(low: float, high: float) -> None:
    with pytest.raises(InvalidInput, match="are not a range"):
        RailLimits(min_m=low, max_m=high)
    with pytest.raises(InvalidInput, match="are not a range"):
        PanTiltLimits(pan_min_rad=low, pan_max_rad=high, tilt_min_rad=0.0, tilt_max_rad=1.0)
    with pytest.raises(InvalidInput, match="are not a range"):
        PanTiltLimits(pan_min_rad=0.0, pan_max_rad=1.0, tilt_min_rad=low, tilt_max_rad=high)


@pytest.mark.parametrize("low_pass_hz", [0, -5, 1001])
def test_a_filter_that_the_controller_lacks_is_refused_before_it_is_connected(low_pass_hz: int) -> None:
    clock = VirtualClock(1_000_000_000)
    controller = LoopbackController(clock, RecordingCables())

    with pytest.raises(OutOfRange, match="whole numbers from 1 to 1000"):
        ControllerMirrors(controller.open, clock, low_pass_hz=low_pass_hz)
