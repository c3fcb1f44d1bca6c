"""The loop's arithmetic without a rig: settings, PID, step responses, relay on a plant, fault gate."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_hardware.contract import Cancelled, DeviceFault, InvalidInput, Timeout
from foveacam_pipeline.continuous_loop.autotune import autotune
from foveacam_pipeline.continuous_loop.fault_gate import LATCH_AFTER, FaultGate
from foveacam_pipeline.continuous_loop.guide_match import LoopErrors
from foveacam_pipeline.continuous_loop.pid import LONGEST_STEP, Pid, loop_time
from foveacam_pipeline.continuous_loop.polish import search_gains
from foveacam_pipeline.continuous_loop.relay import AMPLITUDES_RAD, TuneRefused, relay
from foveacam_pipeline.continuous_loop.settings import (
    AXES,
    BOUNDS,
    GROUP_OF,
    MOST_GAIN,
    Axis,
    Gains,
    LoopSettings,
)
from foveacam_pipeline.continuous_loop.step_experiment import cost_of, measure_steps, settle
from foveacam_pipeline.continuous_loop.step_response import step_response
from foveacam_pipeline.continuous_loop.vergence_loop import LoopStatus, LoopStep, VergenceLoop

LOOK_NS = 60_000_000
DT = loop_time(LOOK_NS / 1e9, LoopSettings().sensitivity)


# Settings ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", BOUNDS)
@pytest.mark.parametrize("beyond", [-1.0, 1.0])
def test_a_setting_beyond_its_bounds_is_refused_with_them(name: str, beyond: float) -> None:
    bounds = BOUNDS[name]
    value = bounds.least - 1e-3 if beyond < 0.0 else bounds.most + 1e-3
    with pytest.raises(InvalidInput, match=f"{name}: asked .*, choose {bounds.least:g} to {bounds.most:g}"):
        replace(LoopSettings(), **{name: value})  # type: ignore[arg-type]  # one of the numbers


@pytest.mark.parametrize("name", BOUNDS)
def test_the_bounds_themselves_are_allowed(name: str) -> None:
    for value in (BOUNDS[name].least, BOUNDS[name].most):
        assert getattr(replace(LoopSettings(), **{name: value}), name) == value  # type: ignore[arg-type]  # one of the numbers


@pytest.mark.parametrize("value", [-0.01, MOST_GAIN + 0.01])
def test_a_gain_beyond_its_bounds_is_refused(value: float) -> None:
    with pytest.raises(InvalidInput, match=r"depth\.ki: asked"):
        LoopSettings(depth=Gains(kp=0.1, ki=value, kd=0.0))


# PID -----------------------------------------------------------------------------------------------------


def settled(gains: Gains, *, delay_looks: int = 0, looks: int = 60) -> list[float]:
    """Return the errors of a plant that obeys a command so many looks later, after a step of 1 rad."""
    pid, command = Pid(), [0.0]
    errors = []
    for look in range(looks):
        reached = command[max(0, look - delay_looks)]
        errors.append(1.0 - reached)
        command.append(command[-1] + pid.change_rad(1.0 - reached, reached - 1.0, dt=DT, gains=gains))
    return errors


def test_proportional_and_integral_gains_bring_the_error_to_zero() -> None:
    errors = settled(Gains(kp=0.1, ki=0.02, kd=0.0))
    assert abs(errors[-1]) < 1e-5
    assert errors[1] / errors[0] == pytest.approx(1.0 - 0.1 - 0.02 * DT)


def test_the_derivative_damps_a_late_plant() -> None:
    fast = Gains(kp=0.5, ki=0.0, kd=0.0)
    damped = replace(fast, kd=2.0)
    assert min(settled(damped, delay_looks=1)) > min(settled(fast, delay_looks=1))


def test_a_reset_forgets_the_slope() -> None:
    pid, gains = Pid(), Gains(kp=0.0, ki=0.0, kd=1.0)
    pid.change_rad(0.0, 0.0, dt=DT, gains=gains)
    assert pid.change_rad(0.0, 1.0, dt=DT, gains=gains) < 0.0
    pid.reset()
    assert pid.change_rad(0.0, 5.0, dt=DT, gains=gains) == 0.0


def test_a_long_pause_counts_as_the_longest_step() -> None:
    assert loop_time(30.0, 0.1) == LONGEST_STEP
    assert loop_time(0.02, 0.1) == pytest.approx(2.0)


# Step responses ------------------------------------------------------------------------------------------


def test_a_step_has_settled_when_it_stays_within_two_hundredths() -> None:
    times_ns = [look * LOOK_NS for look in range(6)]
    response = step_response(times_ns, [0.0, 0.99, 1.05, 0.985, 1.01, 1.0])
    assert response.settle_s == pytest.approx(3 * LOOK_NS / 1e9)
    assert response.overshoot == pytest.approx(0.05)


def test_a_step_that_ends_outside_has_not_settled() -> None:
    response = step_response([0, LOOK_NS, 2 * LOOK_NS], [0.0, 0.99, 0.9])
    assert response.settle_s is None
    assert response.overshoot == 0.0


def test_a_step_that_is_slower_or_overshoots_costs_more() -> None:
    times_ns = [look * LOOK_NS for look in range(10)]
    fast = step_response(times_ns, [0.0, 0.8] + 8 * [1.0])
    slow = step_response(times_ns, [1.0 - 0.8**look for look in range(10)])
    over = step_response(times_ns, [0.0, 1.3, 0.9] + 7 * [1.0])
    assert fast.cost < slow.cost
    assert fast.cost < over.cost


def test_overshoot_costs_more_than_falling_short_by_as_much() -> None:
    times_ns = [look * LOOK_NS for look in range(10)]
    short, over = (step_response(times_ns, [0.0, second] + 8 * [1.0]) for second in (0.7, 1.3))
    assert over.cost > short.cost + 0.1  # its longer way alone costs 0.03


# Relay and tuning on a plant -----------------------------------------------------------------------------


class Plant:
    """A loop whose eyes obey from one look to the next, without pictures.

    `answers`: by which share each axis obeys. `drift_rad`: how the target moves from look to look.
    `statuses`: of looks that differ, by number.
    """

    def __init__(self, answers: dict[Axis, float] | None = None, drift_rad: float = 0.0) -> None:
        head = PlaneHead(z_m=6.0, texture=noise_texture(), binning=2)
        self.loop = VergenceLoop(CALIBRATION, clock=head.clock)
        for axis in AXES:
            self.loop.set_command(axis, math.radians(1.0))
        self._answers = np.array([(answers or {}).get(axis, 1.0) for axis in AXES])
        self._rest = self.loop.command_rad
        self._drift_rad = drift_rad
        self.statuses: dict[int, LoopStatus] = {}
        self.looks = 0

    def step(self) -> LoopStep:
        self.looks += 1
        status = self.statuses.get(self.looks, LoopStatus.TRACKING)
        command = self.loop.command_rad
        values = -self._answers * (command - self._rest) + self._drift_rad * self.looks
        errors = LoopErrors(values_rad=values, point=None, fine=True)
        if status is LoopStatus.TRACKING:
            for index, axis in enumerate(AXES):
                if axis not in self.loop.forced:
                    change = 0.4 * (values[index] + self.loop.reference_rad[index])
                    self.loop.set_command(axis, float(command[index] + change))
        return LoopStep(
            t_ns=self.looks * LOOK_NS,
            status=status,
            command_rad=command,
            target=np.zeros(2),
            errors=errors if status is LoopStatus.TRACKING else None,
        )


def test_a_relay_on_eyes_that_obey_at_once_finds_a_period_of_two_looks_and_their_gain() -> None:
    plant = Plant()
    found = relay(plant.loop, Axis.VERGE, plant.step)
    assert found.period_looks == 2.0
    assert found.amplitude_rad == AMPLITUDES_RAD[0]
    assert found.ultimate_gain == pytest.approx(4.0 / math.pi)
    assert found.ultimate_period == pytest.approx(2.0 * DT)
    gains = found.gains
    assert gains.kp == pytest.approx(found.ultimate_gain / 2.2)
    assert gains.ki == pytest.approx(gains.kp / (2.2 * found.ultimate_period))
    assert gains.kd == pytest.approx(gains.kp * found.ultimate_period / 6.3)
    assert min(settled(gains)) > -0.10


def test_a_relay_puts_the_command_back() -> None:
    plant = Plant()
    before = plant.loop.command_rad
    relay(plant.loop, Axis.PAN_X, plant.step)
    np.testing.assert_array_equal(plant.loop.command_rad, before)
    assert not plant.loop.forced


@pytest.mark.parametrize("answers", [0.0, 0.5])
def test_an_axis_that_does_not_answer_or_with_one_eye_of_two_is_refused(answers: float) -> None:
    plant = Plant({Axis.PAN_Y: answers})
    before = plant.loop.command_rad
    with pytest.raises(TuneRefused, match="pan_y does not answer"):
        relay(plant.loop, Axis.PAN_Y, plant.step)
    np.testing.assert_array_equal(plant.loop.command_rad, before)


def test_a_target_that_moves_is_refused() -> None:
    plant = Plant(drift_rad=math.radians(0.05))
    with pytest.raises(TuneRefused, match="swing"):
        relay(plant.loop, Axis.PAN_X, plant.step)


@pytest.mark.parametrize(
    "status", [LoopStatus.MATCH_STALE, LoopStatus.PAIR_SKEW, LoopStatus.TRIGGER_FAULT, LoopStatus.LOW_SCORE]
)
def test_single_looks_whose_frames_come_late_do_not_end_the_tuning(status: LoopStatus) -> None:
    plant, undisturbed = Plant(), Plant()
    plant.statuses = dict.fromkeys((2, 3, 7), status)
    found = relay(plant.loop, Axis.VERGE, plant.step)
    assert found.ultimate_gain == relay(undisturbed.loop, Axis.VERGE, undisturbed.step).ultimate_gain
    assert plant.looks > undisturbed.looks


def test_a_target_that_is_not_found_in_three_looks_ends_the_tuning_with_gains_and_commands_as_before() -> (
    None
):
    plant = Plant()
    plant.statuses = dict.fromkeys((30, 31, 32), LoopStatus.LOW_SCORE)
    plant.loop.held = {Axis.SHIFT_Y}
    settings, before = plant.loop.settings, plant.loop.command_rad
    with pytest.raises(TuneRefused, match="low score"):
        autotune(plant.loop, plant.step)
    assert plant.loop.settings == settings
    assert plant.loop.held == {Axis.SHIFT_Y}
    np.testing.assert_array_equal(plant.loop.command_rad, before)
    np.testing.assert_array_equal(plant.loop.reference_rad, 0.0)


def test_two_lost_looks_do_not_end_the_tuning() -> None:
    plant = Plant()
    plant.statuses = dict.fromkeys((30, 31), LoopStatus.LOW_SCORE)
    assert autotune(plant.loop, plant.step).settings == plant.loop.settings


def test_whatever_raises_leaves_everything_as_before() -> None:
    plant = Plant()
    settings, before = plant.loop.settings, plant.loop.command_rad

    def cancelled() -> LoopStep:
        if plant.looks == 25:
            raise Cancelled("somebody ended it")
        return plant.step()

    with pytest.raises(Cancelled):
        autotune(plant.loop, cancelled)
    assert plant.loop.settings == settings
    np.testing.assert_array_equal(plant.loop.command_rad, before)


def test_axes_that_are_held_keep_their_commands_after_tuning() -> None:
    plant = Plant()
    plant.loop.held = {Axis.SHIFT_Y}
    before = plant.loop.command_rad
    told: list[tuple[int, int]] = []
    autotune(plant.loop, plant.step, on_progress=lambda done, of: told.append((done, of)))
    assert plant.loop.held == {Axis.SHIFT_Y}
    assert plant.loop.command_rad[AXES.index(Axis.SHIFT_Y)] == before[AXES.index(Axis.SHIFT_Y)]
    assert told[-1][0] == told[-1][1]


def test_the_time_for_correcting_does_not_end_while_the_loop_is_tuned() -> None:
    plant = Plant()
    plant.loop.settings = replace(plant.loop.settings, correct_for_ms=100.0)
    limits_ms = set()

    def step() -> LoopStep:
        limits_ms.add(plant.loop.settings.correct_for_ms)
        return plant.step()

    assert autotune(plant.loop, step).settings.correct_for_ms == 100.0
    assert limits_ms == {None}
    assert plant.loop.settings.correct_for_ms == 100.0


def test_pan_gets_the_gains_of_its_axis_that_allows_less() -> None:
    plant = Plant({Axis.PAN_X: 0.8})  # so that it would bear more
    result = autotune(plant.loop, plant.step)
    gains = {one.axis: one.gains for one in result.relays}
    assert gains[Axis.PAN_X].kp > 1.2 * gains[Axis.PAN_Y].kp
    assert result.settings.pan.kp == gains[Axis.PAN_Y].kp


class GainPlant(Plant):
    """A plant that is corrected by the gains of its loop."""

    def step(self) -> LoopStep:
        before = self.loop.command_rad
        done = super().step()
        for index, axis in enumerate(AXES):
            gains = self.loop.settings.gains(GROUP_OF[axis])
            if done.errors is not None and axis not in self.loop.forced:
                error = float(done.errors.values_rad[index] + self.loop.reference_rad[index])
                self.loop.set_command(axis, float(before[index] + (gains.kp + gains.ki * DT) * error))
        return done


def test_a_search_for_gains_returns_better_ones_than_it_began_with() -> None:
    plant = GainPlant()
    slow = Gains(kp=0.15, ki=0.001, kd=0.0)
    begin = plant.loop.settings = replace(plant.loop.settings, pan=slow, depth=slow, vertical=slow)
    found = search_gains(plant.loop, plant.step, begin, 30, 0, lambda: None)
    costs = []
    for plant.loop.settings in (begin, found):
        settle(plant.loop, plant.step)
        costs.append(cost_of(measure_steps(plant.loop, plant.step)))
    assert costs[1] < 0.8 * costs[0]


def test_polishing_is_no_worse_than_the_relays_and_stays_within_the_bounds() -> None:
    plant = Plant()
    result = autotune(plant.loop, plant.step, polish=True, candidates=10)
    assert result.cost <= result.cost_relay
    assert result.candidates == 10


# Fault gate ----------------------------------------------------------------------------------------------


def failure(number: int) -> DeviceFault:
    return DeviceFault(f"camera left: exposure {number} was triggered and no frame came")


def test_the_gate_latches_after_ten_equal_failures_and_a_reset_opens_it() -> None:
    gate = FaultGate()
    for number in range(LATCH_AFTER):
        assert not gate.latched
        assert gate.failed(failure(995 + number))
    assert gate.latched
    gate.reset()
    assert (gate.latched, gate.reason, gate.failures) == (False, None, LATCH_AFTER)


def test_failures_of_another_kind_or_a_good_exposure_begin_the_count_anew() -> None:
    gate = FaultGate()
    for number in range(LATCH_AFTER - 1):
        gate.failed(failure(number))
    gate.failed(Timeout("controller: no answer"))
    assert (gate.in_a_row, gate.latched) == (1, False)
    gate.passed()
    assert (gate.in_a_row, gate.exposures, gate.reason) == (0, 1, None)


def test_what_is_no_failure_of_the_trigger_is_not_counted() -> None:
    gate = FaultGate()
    assert not gate.failed(Cancelled("stopped"))
    assert gate.failures == 0
