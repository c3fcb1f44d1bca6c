"""Computes the times of each stage and each thread's share of a core from two readings."""

import threading
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from foveacam_server.foundation.watching import timings
from foveacam_server.foundation.watching.flows import EVENT_LOOP, NATIVE, plain_thread_name
from foveacam_server.resources.operating.engine.schema import StageDocument, ThreadDocument

REQUEST = "request"
BUSY_SHARE = 0.9
"""Busy share from which a thread counts as not keeping up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BucketCounts:
    """Cumulative histogram since the process began: `counts[i]` observations took at most `bounds_s[i]`."""

    bounds_s: tuple[float, ...]
    counts: tuple[float, ...]

    def since(self, before: "BucketCounts | None") -> "BucketCounts":
        """Return the histogram of the observations since an earlier reading."""
        if before is None:
            return self
        counts = tuple(now - then for now, then in zip(self.counts, before.counts, strict=True))
        return BucketCounts(bounds_s=self.bounds_s, counts=counts)

    def quantile_s(self, share: float) -> float | None:
        """Return the quantile at `share` of the observations, s, linear within its bucket.

        Beyond the last finite bound, that bound is returned; None without observations.
        """
        wanted, low_s, below = share * self.counts[-1], 0.0, 0.0
        if self.counts[-1] <= 0:
            return None
        for bound_s, count in zip(self.bounds_s[:-1], self.counts[:-1], strict=True):
            if count >= wanted:
                return low_s + (bound_s - low_s) * (wanted - below) / (count - below)
            low_s, below = bound_s, count
        return low_s


def read_stages() -> dict[str, BucketCounts]:
    """Return the histogram of each stage, and of all requests together."""
    counts: dict[str, dict[float, float]] = {}
    for metric in timings.REGISTRY.collect():
        for sample in metric.samples:
            if sample.name.endswith("_bucket"):
                buckets = counts.setdefault(sample.labels.get("stage", REQUEST), {})
                bound_s = float(sample.labels["le"])
                buckets[bound_s] = buckets.get(bound_s, 0.0) + sample.value
    return {
        stage: BucketCounts(bounds_s=tuple(buckets), counts=tuple(buckets.values()))
        for stage, buckets in counts.items()
    }


def stage_documents(
    now: Mapping[str, BucketCounts], before: Mapping[str, BucketCounts], *, window_s: float
) -> list[StageDocument]:
    """Return the times of each stage since an earlier reading, `window_s` ago."""
    return [
        _document(stage, found.since(before.get(stage)), window_s=window_s) for stage, found in now.items()
    ]


def _document(stage: str, found: BucketCounts, *, window_s: float) -> StageDocument:
    count = found.counts[-1]
    return StageDocument(
        stage=stage,
        window_s=round(window_s, 1),
        count=round(count),
        rate_hz=round(count / window_s, 2) if window_s > 0 else 0.0,
        median_ms=_ms(found.quantile_s(0.5)),
        p99_ms=_ms(found.quantile_s(0.99)),
    )


def _ms(time_s: float | None) -> float | None:
    return None if time_s is None else round(1e3 * time_s, 2)


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
    """Return the threads of each name where the system does not report CPU times."""
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
