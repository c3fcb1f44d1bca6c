"""A queue of actions with due times, which every simulated firmware runs on."""

import heapq
from collections.abc import Callable
from typing import TypeAlias

Action: TypeAlias = Callable[[int], None]
"""Called with its due time, ns."""


class PlannedAction:
    """An action in the queue."""

    __slots__ = ("action", "order", "t_ns")

    def __init__(self, t_ns: int, order: int, action: Action) -> None:
        self.t_ns = t_ns
        self.order = order
        self.action: Action | None = action

    def __lt__(self, other: "PlannedAction") -> bool:
        return (self.t_ns, self.order) < (other.t_ns, other.order)

    def cancel(self) -> None:
        """Do not run it; no effect once it has run."""
        self.action = None


class Agenda:
    """Actions ordered by due time, and by insertion where the times are equal."""

    def __init__(self) -> None:
        self._entries: list[PlannedAction] = []
        self._count = 0

    def add(self, t_ns: int, action: Action) -> PlannedAction:
        """Plan `action` for `t_ns`."""
        self._count += 1
        entry = PlannedAction(t_ns, self._count, action)
        heapq.heappush(self._entries, entry)
        return entry

    def next_ns(self) -> int | None:
        """Return the due time of the next action; None when the queue is empty."""
        while self._entries and self._entries[0].action is None:
            heapq.heappop(self._entries)
        return self._entries[0].t_ns if self._entries else None

    def run_until(self, t_ns: int) -> None:
        """Run every action due at `t_ns` or before, in order."""
        while (due_ns := self.next_ns()) is not None and due_ns <= t_ns:
            entry = heapq.heappop(self._entries)
            if entry.action is not None:
                entry.action(entry.t_ns)

    def clear(self) -> None:
        """Discard every action."""
        self._entries.clear()
