"""The step of a simulated rig's renderer: while its kernels are compiled, and when the server ends then."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from tests.support.devices.fake_rig import FakeRig, Pictures

from foveacam_hardware.contract import Cancelled, MonotonicClock
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_thread.kernel_preparation import KernelProgress, OnKernels
from foveacam_server.rig.live_views import LiveRates

PATIENCE_S = 10.0


class SlowKernels:
    """A preparation that has compiled 14 of 23 kernels, and goes on when told."""

    def __init__(self, why: str | None = None) -> None:
        self.why, self.begun, self.go_on, self.cancelled = why, *(threading.Event() for _ in range(3))

    def __call__(self, on_progress: OnKernels, *, cancelled: Callable[[], bool]) -> str | None:
        on_progress(KernelProgress(done=14, total=23, left_s=18.0))
        self.begun.set()
        while not self.go_on.wait(0.01):
            if cancelled():
                self.cancelled.set()
                raise Cancelled("the job was cancelled")
        return self.why


@pytest.fixture
def events(tmp_path: Path) -> Iterator[EventLog]:
    with Store(tmp_path) as store:
        log = EventLog(store)
        yield log
        log.close()


def opening(events: EventLog, kernels: SlowKernels, rig: FakeRig) -> HardwareThread:
    hardware = HardwareThread(
        lambda: rig,
        sink=Pictures(),
        events=events,
        clock=rig.clock,
        overlay=lambda _gaze: None,
        limits=LiveRates(),
        prepare=kernels,
    )
    hardware.start()
    assert kernels.begun.wait(PATIENCE_S) or not rig.simulated
    return hardware


@pytest.mark.parametrize("why", [None, "no folder for compiled kernels can be written"])
def test_the_step_says_how_far_it_is_and_then_why_the_server_compiled_by_itself(
    events: EventLog, why: str | None
) -> None:
    kernels = SlowKernels(why)
    hardware = opening(events, kernels, FakeRig(MonotonicClock()))
    try:
        step = hardware.opening.steps.every[1]
        assert (step.device, step.state, step.detail) == ("renderer", "active", "14 of 23 kernels")
        assert step.left_s == 18.0 and hardware.opening.preparing and not hardware.status.opened
        kernels.go_on.set()
        assert hardware.wait_open(PATIENCE_S)
        step = hardware.opening.steps.every[1]
        assert (step.state, step.left_s, hardware.opening.preparing) == ("done", None, False)
        assert step.detail == ("" if why is None else f"The server compiled its kernels by itself: {why}")
    finally:
        hardware.close()


def test_a_server_that_ends_meanwhile_cancels_the_step_and_connects_no_device(events: EventLog) -> None:
    kernels, rig = SlowKernels(), FakeRig(MonotonicClock())
    connected = threading.Event()
    rig.connect = lambda *, watch=None: connected.set()  # type: ignore[method-assign]
    opening(events, kernels, rig).close()

    assert kernels.cancelled.is_set() and rig.closed.is_set() and not connected.is_set()


def test_a_rig_of_hardware_has_no_renderer(events: EventLog) -> None:
    kernels, rig = SlowKernels(), FakeRig(MonotonicClock())
    rig.simulated = False
    hardware = opening(events, kernels, rig)
    try:
        assert hardware.wait_open(PATIENCE_S)
        assert "renderer" not in [step.device for step in hardware.opening.steps.every]
        assert not kernels.begun.is_set()
    finally:
        hardware.close()
