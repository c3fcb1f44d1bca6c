"""Any sequence of commands, silence, restarts, alarms and cut cables: no positioner claims a false position.

`foveacam bench faults` takes thousands of random sequences; here hypothesis chooses a few.
"""

from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule, run_state_machine_as_test

from foveacam_bench.faults.positioner_trial import KINDS, STEPS, WAITS_S, PositionerTrial, TrialKind


class PositionerSequence(RuleBasedStateMachine):
    """Steps of a trial, chosen by hypothesis; `kind` is set by the test."""

    kind: TrialKind

    def __init__(self) -> None:
        super().__init__()
        self.trial = PositionerTrial(self.kind)

    @initialize(is_homed=st.booleans())
    def begin(self, is_homed: bool) -> None:
        self.trial.connect()
        if is_homed:
            self.trial.confirm_zero()
            self.trial.home()
            self.trial.wait(6.0)

    @rule(step=st.sampled_from(STEPS))
    def step(self, step: Callable[[PositionerTrial], None]) -> None:
        step(self.trial)

    @rule(share=st.floats(-1.0, 1.0))
    def move(self, share: float) -> None:
        self.trial.move(share)

    @rule(wait_s=st.sampled_from(WAITS_S))
    def wait(self, wait_s: float) -> None:
        self.trial.wait(wait_s)

    @rule(wait_s=st.sampled_from(WAITS_S))
    def look_away(self, wait_s: float) -> None:
        self.trial.look_away(wait_s)

    @invariant()
    def state_is_true(self) -> None:
        self.trial.check()

    def teardown(self) -> None:
        self.trial.recover()


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_position_is_known_only_where_it_is_true_and_can_be_found_again(kind: TrialKind) -> None:
    machine = type("Sequence", (PositionerSequence,), {"kind": kind})

    run_state_machine_as_test(
        machine,
        settings=settings(
            max_examples=15,
            stateful_step_count=12,
            derandomize=True,
            deadline=None,
            database=None,
            suppress_health_check=list(HealthCheck),
        ),
    )
