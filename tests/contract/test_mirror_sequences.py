"""Any sequence of commands, silence, restarts and cut cables: the mirrors' driver claims no false volts.

`foveacam bench faults` takes hundreds of random sequences; here hypothesis chooses a few.
"""

from collections.abc import Callable

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule, run_state_machine_as_test

from foveacam_bench.faults.mirror_trial import STEPS, MirrorTrial


class MirrorSequence(RuleBasedStateMachine):
    """Steps of a trial, chosen by hypothesis."""

    @initialize(strict=st.booleans())
    def begin(self, strict: bool) -> None:
        self.trial = MirrorTrial(strict=strict)
        self.trial.connect()

    @rule(step=st.sampled_from(STEPS))
    def step(self, step: Callable[[MirrorTrial], None]) -> None:
        step(self.trial)

    @rule(share=st.floats(-1.0, 1.0))
    def steer(self, share: float) -> None:
        self.trial.steer(share)

    @rule(share=st.floats(-1.0, 1.0))
    def expose(self, share: float) -> None:
        self.trial.expose(share)

    @rule(wait_s=st.sampled_from((0.05, 1.5)))
    def wait(self, wait_s: float) -> None:
        self.trial.wait(wait_s)

    @invariant()
    def state_is_true(self) -> None:
        self.trial.check()

    def teardown(self) -> None:
        try:
            self.trial.recover()
        finally:
            self.trial.close()


def test_enabled_with_volts_is_said_only_where_rail_and_outputs_have_them() -> None:
    run_state_machine_as_test(
        MirrorSequence,
        settings=settings(
            max_examples=10,
            stateful_step_count=10,
            derandomize=True,
            deadline=None,
            database=None,
            suppress_health_check=list(HealthCheck),
        ),
    )
