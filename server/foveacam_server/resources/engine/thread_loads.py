"""Computes the share of a core that each thread used between two samples of its CPU time."""

import threading
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from foveacam_server.foundation.watching.flows import EVENT_LOOP, NATIVE, plain_thread_name
from foveacam_server.resources.engine.schema import ThreadDocument

BUSY_SHARE = 0.9
"""From this share of the time on, a thread does not keep up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ThreadSample:
    """CPU time of each thread, by its number, at one moment."""

    t_s: float
    cpu_s: Mapping[int, float]


def thread_names(loop_thread: int) -> dict[int, str]:
    """Return the names of Python's threads by their number; `loop_thread` is the event loop's."""
    names = {thread.native_id: plain_thread_name(thread.name) for thread in threading.enumerate()}
    return {number: name for number, name in names.items() if number is not None} | {loop_thread: EVENT_LOOP}


def thread_loads(
    before: ThreadSample, now: ThreadSample, *, names: Mapping[int, str]
) -> list[ThreadDocument]:
    """Return the load of the threads of each name, the busiest first."""
    window_s = now.t_s - before.t_s
    shares: dict[str, list[float]] = {}
    for number, cpu_s in now.cpu_s.items():
        used_s = max(cpu_s - before.cpu_s.get(number, 0.0), 0.0)
        shares.setdefault(names.get(number, NATIVE), []).append(used_s / window_s)
    loads = [_load(name, found) for name, found in shares.items()]
    return sorted(loads, key=lambda load: -(load.cpu_share or 0.0))


def unknown_loads(names: Iterable[str]) -> list[ThreadDocument]:
    """Return the threads of each name where the system does not tell their CPU time."""
    counts: dict[str, int] = {}
    for name in names:
        counts[name] = counts.get(name, 0) + 1
    return [
        ThreadDocument(name=name, count=count, cpu_share=None, busiest_share=None, flagged=False)
        for name, count in sorted(counts.items())
    ]


def _load(name: str, shares: list[float]) -> ThreadDocument:
    busiest_share = round(max(shares), 3)
    return ThreadDocument(
        name=name,
        count=len(shares),
        cpu_share=round(sum(shares), 3),
        busiest_share=busiest_share,
        flagged=busiest_share >= BUSY_SHARE,
    )
