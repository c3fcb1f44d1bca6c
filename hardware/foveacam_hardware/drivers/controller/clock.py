"""Maps the controller's clock to the host's from the ping with the smallest uncertainty.

The uncertainty of a ping is half its round trip plus the possible drift of two crystals since.
"""

import threading
from collections import deque
from dataclasses import dataclass

DRIFT = 100e-6
"""Largest rate difference of two crystal clocks (deduced: ±50 ppm each)."""
RESTART_NS = 50_000_000
"""An offset step that exceeds the uncertainties by this much means that the controller restarted."""
DRIFT_SPAN_NS = 5_000_000_000
"""Pings over a shorter time measure their uncertainty, not the drift (deduced: 50 µs in 5 s are 10 ppm)."""
MIN_UNCERTAINTY_NS = 1_000


@dataclass(frozen=True, slots=True)
class _Ping:
    middle_ns: int
    uncertainty_ns: int
    offset_ns: int

    @property
    def controller_ns(self) -> int:
        return self.middle_ns - self.offset_ns

    def uncertainty_at(self, t_ns: int) -> float:
        return self.uncertainty_ns + abs(t_ns - self.middle_ns) * DRIFT


class ClockMap:
    """Offset and drift of the controller's clock, from recent pings; thread-safe."""

    def __init__(self, *, size: int = 64) -> None:
        self._pings: deque[_Ping] = deque(maxlen=size)
        self._lock = threading.Lock()

    @property
    def offset_ns(self) -> int:
        """Host time minus controller time, by the best ping; 0 before the first."""
        with self._lock:
            return self._best(self._pings[-1].middle_ns).offset_ns if self._pings else 0

    def age_ns(self, t_ns: int) -> int | None:
        """Return the time since the last ping, ns; None before the first."""
        with self._lock:
            return t_ns - self._pings[-1].middle_ns if self._pings else None

    def uncertainty_ns(self, t_ns: int) -> int | None:
        """Return the uncertainty of `host_ns` at `t_ns`, ns; None before the first ping."""
        with self._lock:
            return round(self._best(t_ns).uncertainty_at(t_ns)) if self._pings else None

    @property
    def drift_ppm(self) -> float | None:
        """How much faster the controller's clock runs, ppm; None until the pings span `DRIFT_SPAN_NS`."""
        with self._lock:
            pings = list(self._pings)
        if not pings or pings[-1].middle_ns - pings[0].middle_ns < DRIFT_SPAN_NS:
            return None
        start_ns, start_offset_ns = pings[0].middle_ns, pings[0].offset_ns
        weights = [1.0 / max(ping.uncertainty_ns, MIN_UNCERTAINTY_NS) ** 2 for ping in pings]
        total = sum(weights)
        mean_t = sum(w * (p.middle_ns - start_ns) for w, p in zip(weights, pings, strict=True)) / total
        mean_offset = (
            sum(w * (p.offset_ns - start_offset_ns) for w, p in zip(weights, pings, strict=True)) / total
        )
        across = along = 0.0
        for weight, ping in zip(weights, pings, strict=True):
            t = ping.middle_ns - start_ns - mean_t
            across += weight * t * (ping.offset_ns - start_offset_ns - mean_offset)
            along += weight * t * t
        return (
            -across / along * 1e6
        )  # the offset is host minus controller: it falls when the latter is faster

    def add(self, *, sent_ns: int, received_ns: int, controller_us: int) -> bool:
        """Add one ping; when the controller's clock has jumped, discard all others and return False."""
        middle_ns = (sent_ns + received_ns) // 2
        ping = _Ping(middle_ns, (received_ns - sent_ns + 1) // 2, middle_ns - controller_us * 1000)
        with self._lock:
            steady = self._agrees(ping)
            if not steady:
                self._pings.clear()
            self._pings.append(ping)
            return steady

    def host_ns(self, controller_us: int) -> int:
        """Return the host time of a controller time."""
        return controller_us * 1000 + self.offset_ns

    def _best(self, t_ns: int) -> _Ping:
        return min(self._pings, key=lambda ping: ping.uncertainty_at(t_ns))

    def _agrees(self, ping: _Ping) -> bool:
        if not self._pings:
            return True
        last = self._pings[-1]
        later = ping.middle_ns - ping.uncertainty_ns >= last.middle_ns + last.uncertainty_ns
        if later and ping.controller_ns < last.controller_ns:  # no clock runs backwards
            return False
        best = self._best(ping.middle_ns)
        allowed_ns = best.uncertainty_at(ping.middle_ns) + ping.uncertainty_ns + RESTART_NS
        return abs(ping.offset_ns - best.offset_ns) <= allowed_ns
