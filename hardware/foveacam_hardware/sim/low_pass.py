"""The linear part of a mirror's dynamics: the drive's low-pass filter, then one resonant mode.

Inputs are constant between DAC writes, so the states follow in closed form, without numerical integration.
Volts in, volts out; the law from volts to tilt is in `mirror`.
"""

from bisect import bisect_right
from dataclasses import dataclass
from functools import cache
from math import factorial
from typing import TypeAlias

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

States: TypeAlias = NDArray[np.float64]
"""(7, k) float64: five states of the filter and two of the mode, for k axes."""

KEEP_NS = 10_000_000_000  # a slow machine may render an exposure seconds after it
FILTER_ORDER = 5  # MAX7413, a switched-capacitor Bessel filter


@dataclass(frozen=True, slots=True, kw_only=True)
class ResonantMode:
    """A resonance of the mirror on its springs; its static gain is 1."""

    frequency_hz: float
    quality: float


@dataclass(frozen=True, slots=True, eq=False)
class _System:
    """x' = A x + b u in modal form, A = V diag(rates) V^-1; the steady state is x = rest u."""

    rates: NDArray[np.complex128]
    vectors: NDArray[np.complex128]
    inverse: NDArray[np.complex128]
    rest: NDArray[np.float64]

    def decay(self, deviation: States, dt_s: float) -> States:
        """Return the deviation (7, k) from the steady state after `dt_s`."""
        modal = self.inverse @ deviation
        return np.asarray((self.vectors @ (np.exp(self.rates * dt_s)[:, None] * modal)).real)


def bessel_polynomial(order: int) -> NDArray[np.float64]:
    """Return the denominator of a Bessel low-pass with -3 dB at 1 rad/s, (order + 1,), the constant first.

    The reverse Bessel polynomial (Thomson 1949), its frequency scaled. Written out because scipy.signal takes
    1.5 s to import, which every start of a server would wait for.
    """
    powers = np.arange(order + 1)
    delay = np.array(
        [factorial(2 * order - k) / (factorial(k) * factorial(order - k)) for k in range(order + 1)]
    )
    delay *= 2.0 ** (powers - order)
    at_iw = delay * (-1.0) ** (powers // 2)  # on the imaginary axis even powers are real, odd ones imaginary
    real, imaginary = Polynomial(at_iw * (powers % 2 == 0)), Polynomial(at_iw * (powers % 2))
    half_power = real**2 + imaginary**2 - 2.0 * delay[0] ** 2
    roots = half_power.roots()
    edge = roots[(abs(roots.imag) < 1e-9) & (roots.real > 0.0)].real.min()
    return np.asarray(delay * edge ** (powers - order), dtype=np.float64)


@cache
def _system(cutoff_hz: int, mode: ResonantMode) -> _System:
    denominator = bessel_polynomial(FILTER_ORDER)
    # Scaling A and b together keeps the steady state independent of the cut-off: a change of the filter clock
    # during a move leaves the charges of the capacitors.
    scale = 2.0 * np.pi * cutoff_hz
    omega = 2.0 * np.pi * mode.frequency_hz
    n = FILTER_ORDER
    a = np.zeros((n + 2, n + 2))
    a[:n, :n] = scale * (
        np.eye(n, k=-1) - np.outer(np.eye(n)[0], denominator[-2::-1])
    )  # controller canonical form
    a[n, n + 1] = omega
    a[n + 1, n - 1] = omega * denominator[0]
    a[n + 1, n] = -omega
    a[n + 1, n + 1] = -omega / mode.quality
    b = np.zeros(n + 2)
    b[0] = scale
    rates, vectors = np.linalg.eig(a)
    return _System(
        rates=np.asarray(rates, dtype=np.complex128),
        vectors=np.asarray(vectors, dtype=np.complex128),
        inverse=np.linalg.inv(vectors).astype(np.complex128),
        rest=np.asarray(-np.linalg.solve(a, b), dtype=np.float64),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Segment:
    """Constant inputs from `t_ns` on; `deviation` (7, k): from the steady state at `t_ns`."""

    t_ns: int
    inputs: NDArray[np.float64]
    system: _System
    deviation: States

    def states(self, t_ns: int) -> States:
        rest = np.outer(self.system.rest, self.inputs)
        return rest + self.system.decay(self.deviation, max(0, t_ns - self.t_ns) * 1e-9)


class DriveHistory:
    """The output of each axis at any time of the last 10 s; not thread safe."""

    def __init__(self, *, axes: int, mode: ResonantMode, cutoff_hz: int, t_ns: int) -> None:
        self._mode = mode
        self._cutoff_hz = cutoff_hz
        system = _system(cutoff_hz, mode)
        still = np.zeros((FILTER_ORDER + 2, axes))
        self._segments = [_Segment(t_ns, np.zeros(axes), system, still)]
        self._times_ns = [t_ns]

    def set_inputs(self, t_ns: int, inputs_v: NDArray[np.float64]) -> None:
        """Set the inputs (k,), volts, from `t_ns` on; calls come in the order of time."""
        self._add_segment(t_ns, np.array(inputs_v, dtype=np.float64), _system(self._cutoff_hz, self._mode))

    def set_low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        """Set the filter's cut-off from `t_ns` on."""
        self._cutoff_hz = cutoff_hz
        self._add_segment(t_ns, self._segments[-1].inputs, _system(cutoff_hz, self._mode))

    def output_v(self, t_ns: int) -> NDArray[np.float64]:
        """Return the output of the mode at `t_ns`: (k,) volts."""
        return np.asarray(self._segment(t_ns).states(t_ns)[FILTER_ORDER], dtype=np.float64)

    def _segment(self, t_ns: int) -> _Segment:
        return self._segments[max(0, bisect_right(self._times_ns, t_ns) - 1)]

    def _add_segment(self, t_ns: int, inputs: NDArray[np.float64], system: _System) -> None:
        last = self._segments[-1]
        t_ns = max(t_ns, last.t_ns)
        states = last.states(t_ns)
        self._segments.append(_Segment(t_ns, inputs, system, states - np.outer(system.rest, inputs)))
        self._times_ns.append(t_ns)
        self._discard(t_ns - KEEP_NS)

    def _discard(self, before_ns: int) -> None:
        old = bisect_right(self._times_ns, before_ns) - 1
        if old > 256:  # in batches: a thousand writes a second would each shift the lists
            del self._segments[:old]
            del self._times_ns[:old]
