"""Counts the outcomes of all fault sequences; cables that count voltages outside the limits."""

import threading
from dataclasses import dataclass, field

from foveacam_bench.figures import Figures
from foveacam_bench.judging import percentile
from foveacam_hardware.contract import MirrorLimits
from foveacam_hardware.drivers.controller.volts import bias_code
from foveacam_hardware.sim.cables import DacCodes, RecordingCables
from foveacam_hardware.wire.controller_payloads import DAC_FULL_SCALE, DAC_FULL_SCALE_V

KINDS = (
    *("camera_killed", "camera_stopped", "camera_unplugged", "disk_full", "strobe_missing"),
    *("line_cut", "line_garbage", "line_half", "line_silence", "line_stop", "trigger_missing"),
)
"""All kinds of faults; a figure of one that did not occur is null."""


@dataclass(slots=True)
class KindTally:
    """One kind of fault: number, and times of detection and recovery."""

    faults: int = 0
    detected_s: list[float] = field(default_factory=list)
    recovered_s: list[float] = field(default_factory=list)


@dataclass(slots=True)
class FaultTally:
    """Counts of one run of the bench; thread-safe."""

    sequences: int = 0
    faults: int = 0
    absorbed: int = 0
    """Faults without effect: nothing was lost, so nothing could be detected."""
    detected_s: list[float] = field(default_factory=list)
    recovered_s: list[float] = field(default_factory=list)
    hangs: int = 0
    unparked: int = 0
    """Detected faults after which the mirrors were not brought to rest."""
    limit_violations: int = 0
    kinds: dict[str, KindTally] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def add_fault(
        self, *, kind: str, detected_s: float | None, recovered_s: float | None, parked: bool
    ) -> None:
        """Add one fault; without `detected_s` it had no effect, without `recovered_s` it counts as a hang."""
        with self._lock:
            self.faults += 1
            of_kind = self.kinds.setdefault(kind, KindTally())
            of_kind.faults += 1
            if detected_s is None:
                self.absorbed += 1
                return
            self.detected_s.append(detected_s)
            of_kind.detected_s.append(detected_s)
            self.unparked += not parked
            if recovered_s is None:
                self.hangs += 1
            else:
                self.recovered_s.append(recovered_s)
                of_kind.recovered_s.append(recovered_s)

    def add_sequence(self) -> None:
        """Count one finished sequence."""
        with self._lock:
            self.sequences += 1

    def add_hang(self) -> None:
        """Count something that did not end in time."""
        with self._lock:
            self.hangs += 1

    def add_violations(self, count: int) -> None:
        """Count voltages outside the limits, as seen at the far end."""
        with self._lock:
            self.limit_violations += count

    def figures(self) -> Figures:
        """Return the figures that all parts share."""
        return {
            "sequences": self.sequences,
            "faults": self.faults,
            "absorbed": self.absorbed,
            "detected_p95_s": p95(self.detected_s),
            "detected_max_s": max(self.detected_s, default=0.0),
            "recovered_p95_s": p95(self.recovered_s),
            "recovered_max_s": max(self.recovered_s, default=0.0),
            "unparked": self.unparked,
            "limit_violations": self.limit_violations,
            "hangs": self.hangs,
            **self._figures_by_kind(),
        }

    def _figures_by_kind(self) -> Figures:
        figures: Figures = {}
        for kind in sorted({*KINDS, *self.kinds}):
            found = self.kinds.get(kind, KindTally())
            figures[f"{kind}_faults"] = found.faults
            figures[f"{kind}_detected_p95_s"] = p95(found.detected_s) if found.detected_s else None
            figures[f"{kind}_recovered_p95_s"] = p95(found.recovered_s) if found.recovered_s else None
        return figures


class LimitCables(RecordingCables):
    """Cables that count drives outside the mirrors' limits."""

    def __init__(self, limits: MirrorLimits) -> None:
        super().__init__()
        self.violations = 0
        self.rest: DacCodes = (bias_code(limits),) * 8
        volts_per_code = DAC_FULL_SCALE_V / DAC_FULL_SCALE
        self._most_codes = round(limits.max_v / volts_per_code)

    def set_codes(self, t_ns: int, codes: DacCodes) -> None:
        """Record the codes; check them unless the controller has just lost its power."""
        super().set_codes(t_ns, codes)
        if any(codes) and not self._within(codes):
            self.violations += 1

    def _within(self, codes: DacCodes) -> bool:
        differences = (codes[i] - codes[i + 1] for i in range(0, 8, 2))
        return all(abs(difference) <= self._most_codes for difference in differences) and all(
            abs(code - self.rest[0]) <= self._most_codes // 2 + 1 for code in codes
        )

    def rested_since(self, t_ns: int) -> bool:
        """Return whether both mirrors were brought to rest at some time from `t_ns` on."""
        return any(at_ns >= t_ns and codes == self.rest for at_ns, codes in self.drives)


def p95(values: list[float]) -> float:
    """Return the 95th percentile; 0 for no values."""
    return percentile(values, 0.95)
