"""The load of threads, stages, cameras and the start, from made-up samples and a made-up /proc."""

import asyncio
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.support.devices.fake_machine import FakeMachine
from tests.support.devices.hardware_setup import PATIENCE_S, HardwareSetup, hardware_setup

from foveacam_hardware.contract import CameraCounters, Frame, Role, VirtualClock
from foveacam_server.checks.machine import Machine
from foveacam_server.foundation.watching.flows import (
    EVENT_LOOP,
    HARDWARE,
    NATIVE,
    VIEWERS,
    FlowCount,
    FlowKey,
    count_flow,
    plain_thread_name,
    read_flows,
    this_part,
)
from foveacam_server.resources.operating.engine.graph import edge_documents, part_documents
from foveacam_server.resources.operating.engine.loads import (
    BucketCounts,
    ThreadSample,
    read_stages,
    stage_documents,
    thread_loads,
    thread_names,
    unknown_loads,
)
from foveacam_server.resources.operating.engine.process_files import ProcessFiles
from foveacam_server.resources.operating.engine.schema import HardwareLoadDocument
from foveacam_server.resources.operating.engine.service import EngineParts, EngineService
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.hardware_thread.opening_steps import OpeningSteps
from foveacam_server.rig.loop_lag import PERIOD_S, LoopLag
from foveacam_server.rig.ports import AssembledRig
from foveacam_server.rig.status import FrameRate, SlidingMaximum
from foveacam_server.rig.stream import LiveStreams
from foveacam_server.rig.view_state import ViewPicture

S = 1_000_000_000


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[HardwareSetup]:
    with hardware_setup(tmp_path / "data") as found:
        yield found


def stat(user_ticks: int, system_ticks: int, *, begin_ticks: int = 0) -> str:
    """Return what /proc says of a thread whose name has spaces and brackets."""
    return f"7 (a (b) c) S 1 1 1 0 -1 0 0 0 0 0 {user_ticks} {system_ticks} 0 0 20 0 1 0 {begin_ticks} 0"


def test_process_files_tell_cpu_times_age_and_memory(tmp_path: Path) -> None:
    machine = FakeMachine(tmp_path)
    machine.write("/proc/self/task/7/stat", stat(150, 50))
    machine.write("/proc/self/task/8/stat", stat(0, 3))
    machine.write("/proc/self/stat", stat(150, 53, begin_ticks=9000))
    machine.write("/proc/self/status", "Name:\tfoveacam\nVmRSS:\t  204800 kB\n")
    machine.write("/proc/uptime", "100.50 170.00\n")
    machine.write("/proc/self/fd/0")
    machine.write("/proc/self/fd/11")
    files = ProcessFiles(machine.machine)
    assert files.cpu_s() == {7: 2.0, 8: 0.03}
    assert files.age_s() == pytest.approx(10.5)
    assert (files.memory_mb(), files.open_files()) == (200.0, 2)


def test_without_proc_nothing_is_known(tmp_path: Path) -> None:
    files = ProcessFiles(FakeMachine(tmp_path).machine)
    assert files.cpu_s() == {}
    assert (files.age_s(), files.memory_mb(), files.open_files()) == (None, None, None)


def test_a_thread_that_uses_nine_tenths_of_a_core_is_flagged() -> None:
    before = ThreadSample(t_s=10.0, cpu_s={1: 5.0, 2: 1.0, 3: 0.0})
    now = ThreadSample(t_s=12.0, cpu_s={1: 6.8, 2: 1.5, 3: 0.1, 4: 0.4})
    names = {1: "foveacam-hardware", 2: "requests", 4: "requests"}
    loads = thread_loads(before, now, names=names)
    assert [(load.name, load.count, load.cpu_share, load.flagged) for load in loads] == [
        ("foveacam-hardware", 1, 0.9, True),
        ("requests", 2, 0.45, False),
        (NATIVE, 1, 0.05, False),
    ]


def test_two_half_used_threads_of_one_name_are_not_flagged() -> None:
    before = ThreadSample(t_s=0.0, cpu_s={})
    load, *_ = thread_loads(
        before, ThreadSample(t_s=1.0, cpu_s={1: 0.5, 2: 0.5}), names={1: "encoder", 2: "encoder"}
    )
    assert (load.cpu_share, load.busiest_share, load.flagged) == (1.0, 0.5, False)


def test_threads_have_their_names_also_where_their_load_is_unknown() -> None:
    names = thread_names(loop_thread=-1)
    assert names[-1] == EVENT_LOOP
    assert "main" in names.values()
    known = {load.name: load for load in unknown_loads(["requests", "main", "requests"])}
    assert known["requests"].count == 2
    assert known["requests"].cpu_share is None


def test_quantiles_are_linear_within_a_bucket() -> None:
    found = BucketCounts(bounds_s=(0.1, 0.2, float("inf")), counts=(50.0, 90.0, 100.0))
    assert found.quantile_s(0.5) == pytest.approx(0.1)
    assert found.quantile_s(0.7) == pytest.approx(0.15)
    assert found.quantile_s(0.99) == pytest.approx(0.2)  # no longer time is known
    assert BucketCounts(bounds_s=(0.1, float("inf")), counts=(0.0, 0.0)).quantile_s(0.5) is None


def test_stages_count_what_came_since_the_reading_before() -> None:
    bounds_s = (0.1, float("inf"))
    before = {"look": BucketCounts(bounds_s=bounds_s, counts=(100.0, 200.0))}
    now = {
        "look": BucketCounts(bounds_s=bounds_s, counts=(130.0, 230.0)),
        "verge": BucketCounts(bounds_s=bounds_s, counts=(0.0, 0.0)),
    }
    look, verge = stage_documents(now, before, window_s=60.0)
    assert (look.count, look.rate_hz, look.median_ms, look.p99_ms) == (30, 0.5, 50.0, 99.0)
    assert (verge.count, verge.median_ms) == (0, None)


def test_every_stage_has_a_histogram() -> None:
    assert set(read_stages()) >= {"queue", "look", "verge", "depth", "encode"}


def test_flows_are_counted_between_the_threads_that_hand_over() -> None:
    async def on_the_loop() -> str:
        return this_part()

    assert asyncio.run(on_the_loop()) == EVENT_LOOP
    names = {"AnyIO worker thread": "requests", "encoder_1": "encoder", "Thread-12 (run)": "run"}
    assert {name: plain_thread_name(name) for name in names} == names

    key = FlowKey("a camera", "a thread", "frames")
    before = read_flows().get(key, FlowCount())
    count_flow(*key, size_bytes=10)
    count_flow(*key, passed=0, dropped=3)
    found = read_flows()[key]
    assert (found.passed - before.passed, found.dropped - before.dropped) == (1, 3)
    assert found.size_bytes - before.size_bytes == 10


def test_edges_have_the_rates_of_their_window_and_losses_are_flagged() -> None:
    frames, sent = FlowKey("camera left", HARDWARE, "frames"), FlowKey("encoder", VIEWERS, "pictures")
    before = {frames: FlowCount(passed=100)}
    now = {
        frames: FlowCount(passed=200, dropped=5),
        sent: FlowCount(passed=50, dropped=20, size_bytes=10_000_000),
        FlowKey("a", "b", "nothing yet"): FlowCount(),
    }
    camera, viewers = edge_documents(now, before, window_s=10.0)
    assert (camera.rate_hz, camera.dropped_hz, camera.mb_per_s, camera.flagged) == (10.0, 0.5, None, True)
    assert (viewers.rate_hz, viewers.dropped_hz, viewers.mb_per_s, viewers.flagged) == (5.0, 2.0, 1.0, False)
    assert edge_documents(now, {}, window_s=0.0)[0].rate_hz == 0.0
    restarted = {frames: FlowCount(passed=3)}  # counted anew after the camera was lost
    assert edge_documents(restarted, before, window_s=10.0)[0].rate_hz == 0.0


def test_parts_are_the_ends_of_the_edges_with_the_load_of_their_threads() -> None:
    counts = {
        FlowKey("camera left", HARDWARE, "frames"): FlowCount(passed=1),
        FlowKey("view wide", "encoder", "pictures"): FlowCount(passed=1),
        FlowKey("encoder", VIEWERS, "pictures"): FlowCount(passed=1),
    }
    threads = thread_loads(
        ThreadSample(t_s=0.0, cpu_s={}), ThreadSample(t_s=1.0, cpu_s={1: 0.95}), names={1: "encoder"}
    )
    hardware = HardwareLoadDocument(queue_length=2, queue_limit=32, busy_share=0.4, flagged=False)
    edges = edge_documents(counts, {}, window_s=1.0)
    parts = {one.name: one for one in part_documents(edges, threads=threads, hardware=hardware, cameras=[])}
    assert {name: one.kind for name, one in parts.items()} == {
        "camera left": "camera",
        HARDWARE: "thread",
        "view wide": "view",
        "encoder": "thread",
        VIEWERS: "clients",
    }
    assert (parts[HARDWARE].busy_share, parts[HARDWARE].waiting) == (0.4, 2)
    assert (parts["encoder"].busy_share, parts["encoder"].flagged) == (0.95, True)
    assert parts["view wide"].busy_share is None


def test_largest_value_leaves_with_its_window() -> None:
    found = SlidingMaximum(10 * S)
    for t_s, value in ((0, 3), (4, 9), (6, 2), (8, 5)):
        found.add(value, t_ns=t_s * S)
    assert [found.largest(t_s * S) for t_s in (8, 14, 15, 18, 19)] == [9, 9, 5, 5, None]


def test_worst_gap_of_a_camera_includes_the_one_up_to_now() -> None:
    rate = FrameRate()
    assert rate.worst_gap_ns(0) is None
    for seq, t_s in enumerate((0, 1, 4, 5)):
        image = np.zeros((2, 2), dtype=np.uint8)
        rate.add(Frame(role=Role.WIDE, image=image, t_ns=t_s * S, exposure_ns=0, seq=seq))
    assert [rate.worst_gap_ns(t_s * S) for t_s in (5, 9, 13, 40)] == [3 * S, 4 * S, 8 * S, 35 * S]


def test_pictures_that_a_client_did_not_get_are_counted() -> None:
    hub = FrameHub(clock=VirtualClock())
    streams = LiveStreams(hub, boot_id="test")
    shown: list[ViewPicture] = []
    for seq in (1, 2, 3, 40, 41):
        hub.publish("wide", np.full((2, 2), seq, dtype=np.uint8), t_ns=seq, seq=seq)
        picture = hub.newest("wide")
        assert picture is not None
        shown.append(picture)
    streams.count_sent(shown[0], before=None, size_bytes=10)
    streams.count_sent(shown[4], before=shown[0], size_bytes=10)
    assert (streams.sent["wide"], streams.dropped["wide"], streams.bytes_sent) == (2, 3, 20)


def test_opening_steps_know_when_they_began_and_ended() -> None:
    clock = VirtualClock(5 * S)
    steps = OpeningSteps(clock=clock)
    steps.begins("wide")
    clock.sleep_until_ns(7 * S)
    steps.ends("wide", None)
    times = {step.device: (step.began_ns, step.ended_ns) for step in steps.every}
    assert times["wide"] == (5 * S, 7 * S)
    assert times["left"] == (None, None)


def test_a_blocked_event_loop_is_measured() -> None:
    blocked_s = 3 * PERIOD_S

    async def scenario() -> float | None:
        lag = LoopLag(asyncio.get_running_loop())
        assert lag.worst_ms() is None
        time.sleep(blocked_s)  # noqa: ASYNC251 - what is measured
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        lag.close()
        await asyncio.sleep(0)
        return lag.worst_ms()

    worst_ms = asyncio.run(scenario())
    assert worst_ms is not None
    assert worst_ms >= 1e3 * (blocked_s - PERIOD_S) - 1.0


class FakeTimer:
    def __init__(self, when_s: float, callback: Callable[[], object]) -> None:
        self._when_s, self.callback = when_s, callback

    def when(self) -> float:
        return self._when_s


class FakeLoop:
    """A loop whose time is set, and which calls what is due when it is told to."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.timers: list[FakeTimer] = []

    def time(self) -> float:
        return self.now_s

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> FakeTimer:
        self.timers.append(FakeTimer(self.now_s + delay_s, callback))
        return self.timers[-1]

    def turn(self) -> None:
        for timer in [timer for timer in self.timers if timer.when() <= self.now_s]:
            self.timers.remove(timer)
            timer.callback()


def test_the_time_of_a_blocked_loop_is_known_during_the_block_and_after_it() -> None:
    loop = FakeLoop()
    lag = LoopLag(loop)  # type: ignore[arg-type]  # of a loop it uses what the fake has
    for _ in range(100):
        loop.now_s += PERIOD_S + 0.02  # a little late every time
        loop.turn()
        assert lag.blocked_ns() == 0
    loop.now_s += PERIOD_S + 3.0
    assert lag.blocked_ns() == pytest.approx(3 * S, abs=1000)
    loop.turn()
    assert lag.blocked_ns() == pytest.approx(3 * S, abs=1000)
    loop.now_s += PERIOD_S
    loop.turn()
    assert lag.blocked_ns() == pytest.approx(3 * S, abs=1000)


def test_service_describes_a_rig_that_is_not_open(setup: HardwareSetup, tmp_path: Path) -> None:
    machine, clock = FakeMachine(tmp_path / "root"), VirtualClock(100 * S)
    machine.write("/proc/self/task/7/stat", stat(100, 0))
    machine.write("/proc/self/stat", stat(100, 0, begin_ticks=2000))
    machine.write("/proc/uptime", "30.0 0\n")

    async def scenario() -> None:
        engine = engine_of(setup, machine.machine, clock)
        before = engine.describe()
        assert before.window_s is None
        assert before.process.services_opened_s == 10.0
        assert all(load.cpu_share is None for load in before.threads)

        clock.sleep_until_ns(102 * S)
        machine.write("/proc/self/task/7/stat", stat(290, 0))
        engine.update()
        found = engine.describe()
        engine.close()
        assert found.window_s == 2.0
        assert [(load.name, load.cpu_share, load.flagged) for load in found.threads] == [
            (EVENT_LOOP, 0.95, True)
        ]
        assert found.process.cpu_share == 0.95
        assert (found.hardware.busy_share, found.hardware.queue_length) == (None, 0)
        assert found.event_loop.window_s == 10.0
        assert [step.duration_s for step in found.start] == [None] * 5

    asyncio.run(scenario())


def test_a_hardware_thread_that_is_always_at_work_and_a_camera_that_loses_frames_are_flagged(
    setup: HardwareSetup, tmp_path: Path
) -> None:
    hardware, clock = setup.start(), VirtualClock()
    at_work, done = threading.Event(), threading.Event()

    def work(rig: AssembledRig) -> None:
        at_work.set()
        assert done.wait(PATIENCE_S)
        hardware.refresh(rig)

    async def scenario() -> None:
        engine = engine_of(setup, FakeMachine(tmp_path / "root").machine, clock)
        working = hardware.submit(work)
        assert at_work.wait(PATIENCE_S)
        for _ in range(2):
            clock.sleep_until_ns(clock.now_ns() + 2 * S)
            engine.update()
        waiting = hardware.submit(lambda _rig: None)
        busy = engine.describe().hardware
        assert (busy.busy_share, busy.queue_length, busy.flagged) == (1.0, 1, True)

        setup.rig.left.counters = CameraCounters(dropped=3, underrun=2, incomplete=1)
        done.set()
        working.result(PATIENCE_S)
        waiting.result(PATIENCE_S)
        flows = {camera.role: camera for camera in engine.describe().cameras}
        engine.close()
        assert (flows["left"].lost_last_minute, flows["left"].flagged) == (4, True)
        assert (flows["right"].lost_last_minute, flows["right"].flagged) == (0, False)

    asyncio.run(scenario())


def engine_of(setup: HardwareSetup, machine: Machine, clock: VirtualClock) -> EngineService:
    """Return a service that is not started; the event loop is thread 7."""
    streams = LiveStreams(FrameHub(clock=clock), boot_id="test")
    return EngineService(
        EngineParts(
            hardware=setup.hardware,
            streams=streams,
            store=setup.store,
            clock=clock,
            process=ProcessFiles(machine),
            lag=LoopLag(asyncio.get_running_loop()),
            loop_thread=7,
        )
    )
