"""Counts the items that flow from one part of the server to another, and the dropped ones.

A part is a thread by its name, or something without a thread: a camera, the mirrors, a view, the viewers.
"""

import asyncio
import re
import threading
from dataclasses import dataclass
from typing import NamedTuple

from prometheus_client import Counter

from foveacam_server.foundation.watching.timings import REGISTRY

HARDWARE, ENCODER, EVENT_LOOP = "foveacam-hardware", "encoder", "event loop"
MIRRORS, VIEWERS, PANE, FILE = "mirrors", "viewers", "3D pane", "recording file"
NATIVE = "of libraries"
_NAMES = {"AnyIO worker thread": "requests", "asyncio": "requests", "MainThread": "main", "<lambda>": NATIVE}
_NAMELESS = re.compile(r"Thread-\d+ \((.*)\)")
"""Matches the default name of a thread, with its function."""
_NUMBER = re.compile(r"[-_]\d+$")
"""Matches the suffix that `ThreadPoolExecutor` adds to a name."""
_LABELS = ("source", "target", "items")
_PASSED = Counter("foveacam_flow", "What one part handed to another.", _LABELS, registry=REGISTRY)
_DROPPED = Counter("foveacam_flow_dropped", "What did not get there.", _LABELS, registry=REGISTRY)
_BYTES = Counter("foveacam_flow_bytes", "Size of what was handed over.", _LABELS, registry=REGISTRY)


class FlowKey(NamedTuple):
    """A flow: its source, its destination, and the kind of items."""

    source: str
    target: str
    items: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FlowCount:
    """Items since the process began; `size_bytes` is 0 where it is not counted."""

    passed: int = 0
    dropped: int = 0
    size_bytes: int = 0


def plain_thread_name(name: str) -> str:
    """Return a thread's name without its number; threads that answer requests have one name."""
    plain = _NUMBER.sub("", _NAMELESS.sub(r"\1", name))
    return _NAMES.get(plain, plain)


def this_part() -> str:
    """Return the name of the calling thread as a part."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return plain_thread_name(threading.current_thread().name)
    return EVENT_LOOP


def view_part(view: str) -> str:
    """Return the name of a view as a part."""
    return f"view {view}"


def camera_part(role: str) -> str:
    """Return the name of a camera as a part."""
    return f"camera {role}"


def count_flow(
    source: str, target: str, items: str, *, passed: int = 1, dropped: int = 0, size_bytes: int = 0
) -> None:
    """Count items passed on, and those dropped instead."""
    key = FlowKey(source, target, items)
    _PASSED.labels(*key).inc(passed)
    if dropped:
        _DROPPED.labels(*key).inc(dropped)
    if size_bytes:
        _BYTES.labels(*key).inc(size_bytes)


def read_flows() -> dict[FlowKey, FlowCount]:
    """Return the counts since the process began."""
    dropped, size_bytes = _values(_DROPPED), _values(_BYTES)
    return {
        key: FlowCount(passed=passed, dropped=dropped.get(key, 0), size_bytes=size_bytes.get(key, 0))
        for key, passed in _values(_PASSED).items()
    }


def _values(counter: Counter) -> dict[FlowKey, int]:
    return {
        FlowKey(*(sample.labels[name] for name in _LABELS)): int(sample.value)
        for metric in counter.collect()
        for sample in metric.samples
        if sample.name.endswith("_total")
    }
