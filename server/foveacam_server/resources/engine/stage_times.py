"""Computes median and 99th percentile of each stage's time in the last minute from its histogram."""

from collections.abc import Mapping
from dataclasses import dataclass

from foveacam_server.foundation.watching import timings
from foveacam_server.resources.engine.schema import StageDocument

REQUEST = "request"


@dataclass(frozen=True, slots=True, kw_only=True)
class BucketCounts:
    """Observations since the process began: `counts[i]` took at most `bounds_s[i]`."""

    bounds_s: tuple[float, ...]
    counts: tuple[float, ...]

    def since(self, before: "BucketCounts | None") -> "BucketCounts":
        """Return the observations since an earlier reading."""
        if before is None:
            return self
        counts = tuple(now - then for now, then in zip(self.counts, before.counts, strict=True))
        return BucketCounts(bounds_s=self.bounds_s, counts=counts)

    def quantile_s(self, share: float) -> float | None:
        """Return the time that `share` of the observations took at most, linear within its bucket.

        Of times beyond the last finite bound that bound is returned; None without observations.
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
