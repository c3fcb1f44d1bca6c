"""Retries of tasks whose workers die; results are yielded in the order in which tasks finish.

If several tasks were under way when a worker died, each is retried alone, to find the one that kills its
workers without giving up the others. A task that takes much longer than the others is computed twice when
workers idle; its first result counts.
"""

from collections import deque
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from statistics import median
from typing import Generic, TypeVar

from foveacam_hardware.contract import Clock
from foveacam_pipeline.workers.pool import Part, PartLost, WorkPool

Task = TypeVar("Task")
T = TypeVar("T")

MOST_DEATHS = 3
"""Worker deaths of a task that ran alone, after which it is given up."""
POLL_S = 0.01
COUNT_S = 1.0
"""Interval of querying the number of workers."""
LATE_S, LATE_FACTOR = 30.0, 4.0
"""A task is late after this time and after this multiple of the median duration of the others."""
REMEMBERED = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskEnd(Generic[Task, T]):
    """Outcome of a task: its result, or None and the reason why it was given up."""

    task: Task
    result: T | None
    lost: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Attempt(Generic[Task, T]):
    number: int
    task: Task
    part: Part[T]
    began_ns: int
    alone: bool


def run_tasks(
    pool: WorkPool,
    work: Callable[[Task], T],
    tasks: Iterable[Task],
    *,
    clock: Clock,
    stopped: Callable[[], bool],
) -> Generator[TaskEnd[Task, T], None, None]:
    """Yield how each task ended, until all have or it is stopped.

    Raise WorkersLost, or what a task has raised.
    """
    run = _Run(pool, work, tasks, clock=clock)
    try:
        while not stopped() and run.fill():
            yield from run.ended()
    finally:
        run.cancel()


class _Run(Generic[Task, T]):
    def __init__(
        self, pool: WorkPool, work: Callable[[Task], T], tasks: Iterable[Task], *, clock: Clock
    ) -> None:
        self._pool, self._work, self._clock = pool, work, clock
        self._todo = enumerate(tasks)
        self._exhausted = False
        self._suspects: deque[tuple[int, Task]] = deque()
        self._deaths: dict[int, int] = {}
        self._under_way: list[_Attempt[Task, T]] = []
        self._settled: set[int] = set()
        self._took_s: deque[float] = deque(maxlen=REMEMBERED)
        self._most, self._counted_ns = pool.most_under_way, clock.now_ns()

    def fill(self) -> bool:
        """Submit tasks up to the pool's capacity; return whether any is under way."""
        while not self._suspects and not self._exhausted and len(self._under_way) < self._most:
            following = next(self._todo, None)
            if following is None:
                self._exhausted = True
            else:
                self._submit(*following)
        if self._suspects and not self._under_way:
            self._submit(*self._suspects.popleft(), alone=True)
        elif self._exhausted and len(self._under_way) < self._most:
            self._repeat_late()
        return bool(self._under_way)

    def ended(self) -> Generator[TaskEnd[Task, T], None, None]:
        """Yield the outcomes of finished tasks; wait a little if there is none."""
        ended = [attempt for attempt in self._under_way if attempt.part.done()]
        if not ended:
            self._clock.sleep_until_ns(self._clock.now_ns() + round(1e9 * POLL_S))
            return
        self._count_workers()
        self._under_way = [attempt for attempt in self._under_way if attempt not in ended]
        for attempt in ended:
            yield from self._settle(attempt)

    def cancel(self) -> None:
        """Cancel the tasks that have not begun."""
        for attempt in self._under_way:
            attempt.part.cancel()

    def _count_workers(self) -> None:
        """Query the number of workers once a second at most: a cluster answers slowly."""
        now_ns = self._clock.now_ns()
        if now_ns - self._counted_ns > 1e9 * COUNT_S:
            self._most, self._counted_ns = self._pool.most_under_way, now_ns

    def _submit(self, number: int, task: Task, *, alone: bool = False) -> None:
        part = self._pool.submit(self._work, task)
        self._under_way.append(
            _Attempt(number=number, task=task, part=part, began_ns=self._clock.now_ns(), alone=alone)
        )

    def _settle(self, attempt: _Attempt[Task, T]) -> Generator[TaskEnd[Task, T], None, None]:
        if attempt.number in self._settled:
            return
        try:
            result = self._pool.result(attempt.part)
        except PartLost as error:
            yield from self._lost(attempt, str(error))
            return
        self._settled.add(attempt.number)
        self._took_s.append(1e-9 * (self._clock.now_ns() - attempt.began_ns))
        for other in self._under_way:
            if other.number == attempt.number:
                other.part.cancel()
        self._under_way = [other for other in self._under_way if other.number != attempt.number]
        yield TaskEnd(task=attempt.task, result=result)

    def _lost(self, attempt: _Attempt[Task, T], why: str) -> Generator[TaskEnd[Task, T], None, None]:
        deaths = self._deaths.get(attempt.number, 0) + attempt.alone
        self._deaths[attempt.number] = deaths
        if deaths < MOST_DEATHS:
            self._suspects.append((attempt.number, attempt.task))
            return
        self._settled.add(attempt.number)
        yield TaskEnd(task=attempt.task, result=None, lost=f"given up after {deaths} workers died: {why}")

    def _repeat_late(self) -> None:
        """Submit a late task a second time, unless it is already computed twice."""
        if not self._took_s:
            return
        late_ns = 1e9 * max(LATE_S, LATE_FACTOR * median(self._took_s))
        numbers = [attempt.number for attempt in self._under_way]
        for attempt in tuple(self._under_way):
            late = self._clock.now_ns() - attempt.began_ns > late_ns
            if late and numbers.count(attempt.number) == 1 and len(self._under_way) < self._most:
                self._submit(attempt.number, attempt.task)
