"""The kernels of the simulated rig: compiled in children beside each other, or here where that fails."""

import threading
from collections.abc import Callable, Sequence

import pytest

from foveacam_hardware.contract import Cancelled, StorageFull
from foveacam_server.foundation.child_process import OnProgress
from foveacam_server.foundation.child_work import ChildProgress
from foveacam_server.rig.hardware_thread.early_kernels import EarlyKernels
from foveacam_server.rig.hardware_thread.kernel_preparation import (
    COSTS,
    PHASES,
    KernelProgress,
    KernelTools,
    OnKernels,
    compile_in_children,
    prepare_kernels,
)

PATIENCE_S = 10.0


def step(name: str, done: int, total: int = 2) -> ChildProgress:
    return ChildProgress(done=done, total=total, note=name, share=done / total)


def four_kernels() -> int:
    return 4


class Children:
    """Runs functions in place of child processes."""

    def __init__(self, work: Callable[[Sequence[str], OnProgress, Callable[[], bool]], None]) -> None:
        self._work = work
        self.begun: list[tuple[str, ...]] = []

    def __call__(
        self,
        module: str,
        arguments: Sequence[str],
        *,
        on_progress: OnProgress,
        cancelled: Callable[[], bool],
    ) -> None:
        assert module.endswith("kernel_worker")
        self.begun.append(tuple(arguments))
        self._work(arguments, on_progress, cancelled)


def ignore(_progress: KernelProgress) -> None: ...


def wait_until(met: Callable[[], bool]) -> None:
    waiting = threading.Event()
    for _ in range(round(PATIENCE_S / 0.01)):
        if met():
            return
        waiting.wait(0.01)
    raise AssertionError("not met in time")


def test_children_work_beside_each_other_and_parts_come_before_what_needs_them() -> None:
    beside = threading.Barrier(2, timeout=PATIENCE_S)

    def work(_names: Sequence[str], _report: OnProgress, _cancelled: Callable[[], bool]) -> None:
        beside.wait()

    children = Children(work)
    phases = ((("shading",), ("lens",)), (("tiles",), ("sensor",)))

    compile_in_children(
        on_progress=ignore, cancelled=lambda: False, run=children, phases=phases, total=four_kernels
    )

    assert {*children.begun[:2]} == {("shading",), ("lens",)}
    assert {*children.begun[2:]} == {("tiles",), ("sensor",)}


def test_progress_counts_all_phases_and_tells_the_time_left() -> None:
    times_s = iter(range(0, 1000, 4))
    seen: list[KernelProgress] = []

    def work(names: Sequence[str], report: OnProgress, _cancelled: Callable[[], bool]) -> None:
        for done in range(3):
            report(step(names[0], done))

    compile_in_children(
        on_progress=seen.append,
        cancelled=lambda: False,
        run=Children(work),
        phases=((("shading",),), (("tiles",),)),
        now_s=lambda: float(next(times_s)),
        total=four_kernels,
    )

    assert [str(each) for each in seen] == [f"{n} of 4 kernels" for n in (0, 1, 2, 2, 3, 4)]
    whole, half = COSTS["shading"] + COSTS["tiles"], 0.5 * COSTS["shading"]
    assert seen[0].left_s is None  # nothing is done yet
    assert seen[1].left_s == pytest.approx(8.0 * (whole - half) / half)
    assert seen[-1].left_s == 0.0


def test_a_child_that_fails_ends_the_others_and_its_error_is_told() -> None:
    def work(names: Sequence[str], _report: OnProgress, cancelled: Callable[[], bool]) -> None:
        if tuple(names) == ("shading",):
            raise StorageFull("the disk is full")
        wait_until(cancelled)
        raise Cancelled("the job was cancelled")

    with pytest.raises(StorageFull, match="the disk is full"):
        compile_in_children(
            on_progress=ignore,
            cancelled=lambda: False,
            total=four_kernels,
            run=Children(work),
            phases=((("shading",), ("lens",)),),
        )


def test_a_cancelled_preparation_ends_its_children_and_loads_nothing() -> None:
    ending, loaded = threading.Event(), threading.Event()

    def work(names: Sequence[str], report: OnProgress, cancelled: Callable[[], bool]) -> None:
        report(step(names[0], 0))
        ending.set()  # SIGTERM comes while a child compiles
        wait_until(cancelled)
        raise Cancelled("the job was cancelled")

    tools = KernelTools(
        stored=lambda: False,
        trouble=lambda: None,
        load=loaded.set,
        compile=lambda **how: compile_in_children(run=Children(work), total=four_kernels, **how),
    )
    with pytest.raises(Cancelled):
        prepare_kernels(ignore, cancelled=ending.is_set, tools=tools)
    assert not loaded.is_set()


@pytest.mark.parametrize(
    "failure", [StorageFull("no space"), RuntimeError("kernel_worker ended with status -9")]
)
def test_where_a_child_fails_or_is_killed_this_process_compiles_and_says_so(failure: Exception) -> None:
    loaded = threading.Event()

    def fail(**_how: object) -> None:
        raise failure

    tools = KernelTools(stored=lambda: False, trouble=lambda: None, load=loaded.set, compile=fail)
    assert prepare_kernels(ignore, cancelled=lambda: False, tools=tools) == str(failure)
    assert loaded.is_set()


def test_where_nothing_can_be_stored_no_child_is_started() -> None:
    loaded, started = threading.Event(), threading.Event()
    tools = KernelTools(
        stored=lambda: False,
        trouble=lambda: "read-only",
        load=loaded.set,
        compile=lambda **_how: started.set(),
    )
    assert prepare_kernels(ignore, cancelled=lambda: False, tools=tools) == "read-only"
    assert loaded.is_set() and not started.is_set()


def test_stored_kernels_are_only_loaded() -> None:
    loaded, started = threading.Event(), threading.Event()
    tools = KernelTools(
        stored=lambda: True, trouble=lambda: None, load=loaded.set, compile=lambda **_how: started.set()
    )
    assert prepare_kernels(ignore, cancelled=lambda: False, tools=tools) is None
    assert loaded.is_set() and not started.is_set()


def test_the_phases_compile_every_kernel_once_and_its_parts_first() -> None:
    from foveacam_hardware.sim.render.compilation import kernel_steps, part_steps

    assert set(COSTS) == {name for phase in PHASES for share in phase for name in share}
    first, second = ({name for share in phase for name in share} for phase in PHASES)
    named = [name for phase in PHASES for share in phase for name in share]
    parts = {each.name for each in part_steps()}
    assert sorted(named) == sorted(each.name for each in (*kernel_steps(), *part_steps()))
    assert parts <= first and "tiles" in second


def test_early_kernels_are_waited_for_and_prepared_once() -> None:
    calls, go, seen = [], threading.Event(), list[KernelProgress]()
    progress = KernelProgress(done=1, total=4, left_s=2.0)

    def prepare(on_progress: OnKernels, *, cancelled: Callable[[], bool]) -> str | None:
        calls.append(cancelled())
        on_progress(progress)
        assert go.wait(PATIENCE_S)
        return "read-only"

    def show(told: KernelProgress) -> None:
        seen.append(told)
        go.set()

    with EarlyKernels(prepare) as early:
        assert early(show, cancelled=lambda: False) == "read-only"
        assert early(show, cancelled=lambda: False) == "read-only"
    assert seen == [progress] and calls == [False]


def test_early_kernels_are_cancelled_by_who_waits_and_by_the_end_of_the_program() -> None:
    def prepare(on_progress: OnKernels, *, cancelled: Callable[[], bool]) -> str | None:
        on_progress(KernelProgress(done=0, total=4, left_s=None))
        wait_until(cancelled)
        raise Cancelled("the job was cancelled")

    with EarlyKernels(prepare) as waited, pytest.raises(Cancelled):
        waited(ignore, cancelled=lambda: True)
    with EarlyKernels(prepare) as ended:
        pass
    with pytest.raises(Cancelled):
        ended(ignore, cancelled=lambda: False)
