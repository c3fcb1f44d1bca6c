"""Describes the data flow: the parts of the server, and the flows between them."""

from collections.abc import Iterable, Mapping, Sequence

from foveacam_server.foundation.watching.flows import (
    FILE,
    HARDWARE,
    MIRRORS,
    PANE,
    VIEWERS,
    FlowCount,
    FlowKey,
    camera_part,
    view_part,
)
from foveacam_server.resources.operating.engine.schema import (
    CameraFlowDocument,
    EdgeDocument,
    HardwareLoadDocument,
    PartDocument,
    PartKind,
    ThreadDocument,
)

_KINDS: Mapping[str, PartKind] = {MIRRORS: "device", VIEWERS: "clients", PANE: "clients", FILE: "file"}
_PREFIXES: Mapping[str, PartKind] = {camera_part(""): "camera", view_part(""): "view"}
_MB = 1e6


def edge_documents(
    now: Mapping[FlowKey, FlowCount], before: Mapping[FlowKey, FlowCount], *, window_s: float
) -> list[EdgeDocument]:
    """Return all flows observed so far, with their rates since an earlier reading."""
    return [
        _edge(key, found, before.get(key, FlowCount()), window_s=window_s)
        for key, found in sorted(now.items())
        if found.passed or found.dropped
    ]


def part_documents(
    edges: Iterable[EdgeDocument],
    *,
    threads: Iterable[ThreadDocument],
    hardware: HardwareLoadDocument,
    cameras: Sequence[CameraFlowDocument],
) -> list[PartDocument]:
    """Return the parts at the ends of the edges, with their load where they have a thread."""
    names = sorted({name for edge in edges for name in (edge.source, edge.target)})
    loads = {thread.name: (thread.busiest_share, thread.flagged) for thread in threads}
    loads[HARDWARE] = (hardware.busy_share, hardware.flagged)
    loads |= {camera_part(camera.role): (None, camera.flagged) for camera in cameras}
    return [
        PartDocument(
            name=name,
            kind=_kind(name),
            busy_share=loads.get(name, (None, False))[0],
            waiting=hardware.queue_length if name == HARDWARE else None,
            flagged=loads.get(name, (None, False))[1],
        )
        for name in names
    ]


def _kind(name: str) -> PartKind:
    found = next((kind for prefix, kind in _PREFIXES.items() if name.startswith(prefix)), None)
    return found or _KINDS.get(name, "thread")


def _edge(key: FlowKey, now: FlowCount, before: FlowCount, *, window_s: float) -> EdgeDocument:
    def rate(count: int, count_before: int) -> float:
        return round(max(count - count_before, 0) / window_s, 3) if window_s > 0 else 0.0

    dropped_hz = rate(now.dropped, before.dropped)
    sized = now.size_bytes > 0
    return EdgeDocument(
        source=key.source,
        target=key.target,
        items=key.items,
        rate_hz=rate(now.passed, before.passed),
        dropped_hz=dropped_hz,
        mb_per_s=round(rate(now.size_bytes, before.size_bytes) / _MB, 3) if sized else None,
        count=now.passed,
        dropped=now.dropped,
        flagged=dropped_hz > 0 and key.target != VIEWERS,
    )
