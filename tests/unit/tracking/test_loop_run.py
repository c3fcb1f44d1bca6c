"""A run of the loop: its largest rate of looks, its box of a lost target, and targets that are refused."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from tests.support.scenes.plane_head import LOOK_NS, PlaneHead, noise_texture, plain_texture

from foveacam_hardware.contract import PARKED, OutOfRange, Role, VirtualClock
from foveacam_pipeline.continuous_loop.fault_gate import FaultGate
from foveacam_pipeline.continuous_loop.settings import LoopSettings
from foveacam_pipeline.continuous_loop.split_eyes import SplitEyes
from foveacam_pipeline.continuous_loop.target_guide import LOST_MISSES
from foveacam_pipeline.continuous_loop.vergence_loop import LoopStatus, LoopStep, VergenceLoop
from foveacam_pipeline.verge.values import DirectionTarget
from foveacam_server.resources.looking.loop.description import boxes_of
from foveacam_server.resources.looking.loop.loop_run import LoopRun
from foveacam_server.resources.looking.loop.orders import FirstTarget, choose_target, part_eyes

Z_M = 1.7
"""Nearer than where the texture repeats in the wide view."""
AHEAD = np.zeros(2)


class FakeHardware:
    """A rig that is free."""

    use = SimpleNamespace(holder=None, wanted=False)
    halted = False
    pose = PARKED

    @contextmanager
    def session(self, holder: str, **options: object) -> Iterator[None]:
        yield


class VirtualEvent(threading.Event):
    """Waits on a virtual clock."""

    def __init__(self, clock: VirtualClock) -> None:
        super().__init__()
        self._clock = clock

    def wait(self, timeout: float | None = None) -> bool:
        assert timeout is not None
        self._clock.sleep_until_ns(self._clock.now_ns() + round(1e9 * timeout))
        return self.is_set()


class QuickLoop:
    """Takes the time of a look, and sees nothing."""

    def __init__(self, settings: LoopSettings, clock: VirtualClock) -> None:
        self.settings = settings
        self.gate = FaultGate()
        self.guide = object()
        self._clock = clock

    def step(self, head: None) -> LoopStep:
        self._clock.sleep_until_ns(self._clock.now_ns() + LOOK_NS)
        return LoopStep(
            t_ns=self._clock.now_ns(), status=LoopStatus.LOW_SCORE, command_rad=np.zeros(4), target=AHEAD
        )


def looks_of(settings: LoopSettings, *, looks: int) -> list[int]:
    """Return the times of the first looks of a run, ns."""
    clock, times_ns = VirtualClock(), list[int]()

    def note(step: LoopStep) -> None:
        times_ns.append(step.t_ns)
        if len(times_ns) == looks:
            limited.stop_wanted.set()

    limited = LoopRun(
        cast(Any, QuickLoop(settings, clock)), hardware=cast(Any, FakeHardware()), clock=clock, on_step=note
    )
    limited.stop_wanted = VirtualEvent(clock)
    context = SimpleNamespace(
        job=SimpleNamespace(id="job-1"),
        cancelled=lambda: False,
        check=lambda: None,
        progress=lambda *_, **__: None,
    )
    limited.run_while_free(cast(Any, context))
    return times_ns


@pytest.mark.parametrize(("most_hz", "period_ns"), [(5.0, 200_000_000), (None, LOOK_NS)])
def test_looks_come_no_faster_than_the_largest_rate(most_hz: float | None, period_ns: int) -> None:
    times_ns = looks_of(LoopSettings(most_hz=most_hz), looks=5)

    intervals_ns = [after - before for before, after in pairwise(times_ns)]
    assert len(intervals_ns) == 4
    assert all(period_ns <= interval_ns <= period_ns + LOOK_NS for interval_ns in intervals_ns)


# A painted rig ----------------------------------------------------------------------------------------------


@pytest.fixture
def head() -> PlaneHead:
    return PlaneHead(z_m=Z_M, texture=noise_texture(), binning=2)


@pytest.fixture
def blank(head: PlaneHead) -> PlaneHead:
    """A wall without texture before the same rig."""
    return PlaneHead(z_m=Z_M, texture=plain_texture(), noise=0.0, clock=head.clock, binning=2)


@pytest.fixture
def run(head: PlaneHead) -> LoopRun:
    """A run that has a target."""
    loop = VergenceLoop(head.calibration, clock=head.clock)
    loop.choose(head.wide(), AHEAD, inverse_z_per_m=1.0 / Z_M)
    return LoopRun(loop, hardware=cast(Any, FakeHardware()), clock=head.clock, on_step=lambda _: None)


def split_eyes(head: PlaneHead) -> SplitEyes:
    return SplitEyes(head.calibration, clock=head.clock)


def test_only_a_target_that_is_tracked_has_a_box(run: LoopRun, blank: PlaneHead) -> None:
    frame = blank.wide()
    (tracked,) = boxes_of(run, frame)
    for _ in range(LOST_MISSES):
        blank.clock.sleep_until_ns(blank.clock.now_ns() + LOOK_NS)
        run.loop.see_wide(blank.wide())
    (lost,) = boxes_of(run, frame)

    assert tracked.bbox_px is not None
    assert lost.bbox_px is None


def test_a_further_target_that_is_refused_leaves_the_loop_as_it_was(run: LoopRun, blank: PlaneHead) -> None:
    run.split = split = split_eyes(blank)
    guide, command_rad = run.loop.guide, run.loop.command_rad
    wanted = FirstTarget(
        target=DirectionTarget(ax_rad=0.1, ay_rad=0.0),
        place=np.array([np.tan(0.1), 0.0]),
        clicked=None,
        distance_m=3.0 * Z_M,
    )

    with pytest.raises(OutOfRange, match="nothing that could be followed"):
        choose_target(
            run, blank, wanted, calibration=blank.calibration, clock=blank.clock, context=cast(Any, None)
        )

    assert run.loop.guide is guide
    assert run.split is split
    np.testing.assert_array_equal(run.loop.command_rad, command_rad)


def test_a_place_of_one_eye_that_is_refused_does_not_part_the_eyes(run: LoopRun, blank: PlaneHead) -> None:
    with pytest.raises(OutOfRange, match="nothing that could be followed"):
        part_eyes(
            run,
            blank,
            Role.LEFT,
            (719.5, 539.5),
            hardware=cast(Any, FakeHardware()),
            new_split=lambda: split_eyes(blank),
        )

    assert run.split is None
    assert run.loop.guide is not None
