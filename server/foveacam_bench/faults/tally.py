"""What became of all sequences of faults, whoever ran them; and the limits that no voltage may leave."""

import threading
from dataclasses import dataclass, field

from foveacam_hardware.contract import MirrorLimits
from foveacam_hardware.drivers.controller.volts import bias_code
from foveacam_hardware.sim.cables import DacCodes, RecordingCables
from foveacam_hardware.wire.controller_payloads import DAC_FULL_SCALE, DAC_FULL_SCALE_V


@dataclass(slots=True)
class KindTally:
    """One kind of fault: how many there were, and how long each took."""

    faults: int = 0
    detected_s: list[float] = field(default_factory=list)
    recovered_s: list[float] = field(default_factory=list)


@dataclass(slots=True)
class FaultTally:
    """Counts of one run of the bench; any thread adds to it."""

    sequences: int = 0
    faults: int = 0
    absorbed: int = 0
    """Faults that did no harm: nothing was lost, so nothing was to be noticed."""
    detected_s: list[float] = field(default_factory=list)
    recovered_s: list[float] = field(default_factory=list)
    hangs: int = 0
    unparked: int = 0
    """Faults that were noticed and after which the mirrors were not brought to rest."""
    limit_violations: int = 0
    kinds: dict[str, "KindTally"] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def add_fault(
        self, *, kind: str, detected_s: float | None, recovered_s: float | None, parked: bool
    ) -> None:
        """Add one fault; without `detected_s` it did no harm, without `recovered_s` it was a hang."""
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
        """Count one sequence that is over."""
        with self._lock:
            self.sequences += 1

    def add_hang(self) -> None:
        """Count something that never ended."""
        with self._lock:
            self.hangs += 1

    def add_violations(self, count: int) -> None:
        """Count voltages outside the limits, as seen at the far end."""
        with self._lock:
            self.limit_violations += count

    def figures(self) -> dict[str, float | int | bool]:
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

    def _figures_by_kind(self) -> dict[str, float | int | bool]:
        figures: dict[str, float | int | bool] = {}
        for kind, found in sorted(self.kinds.items()):
            figures[f"{kind}_faults"] = found.faults
            figures[f"{kind}_detected_p95_s"] = p95(found.detected_s)
            figures[f"{kind}_recovered_p95_s"] = p95(found.recovered_s)
        return figures


class LimitCables(RecordingCables):
    """Cables that count the drives which a rig's mirrors must never see."""

    def __init__(self, limits: MirrorLimits) -> None:
        super().__init__()
        self.violations = 0
        self.rest: DacCodes = (bias_code(limits),) * 8
        volts_per_code = DAC_FULL_SCALE_V / DAC_FULL_SCALE
        self._most_codes = round(limits.max_v / volts_per_code)

    def set_codes(self, t_ns: int, codes: DacCodes) -> None:
        """Remember the codes; judge them unless the controller has just lost its power."""
        super().set_codes(t_ns, codes)
        if any(codes) and not self._within(codes):
            self.violations += 1

    def _within(self, codes: DacCodes) -> bool:
        differences = (codes[i] - codes[i + 1] for i in range(0, 8, 2))
        return all(abs(difference) <= self._most_codes for difference in differences) and all(
            abs(code - self.rest[0]) <= self._most_codes // 2 + 1 for code in codes
        )

    def rested_since(self, t_ns: int) -> bool:
        """Tell whether both mirrors were brought to rest at some time from `t_ns` on."""
        return any(at_ns >= t_ns and codes == self.rest for at_ns, codes in self.drives)


def p95(values: list[float]) -> float:
    """Return the value that 95 % do not exceed; 0 for none."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(0.95 * len(ordered)))] if ordered else 0.0
