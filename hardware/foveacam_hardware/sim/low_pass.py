"""The linear part of a mirror's drive, propagated exactly: low-pass filter, then one resonant mode.

Inputs are constant between DAC writes, so every state follows in closed form; nothing is integrated in steps.
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
    """A resonance of the mirror in its springs; its gain at rest is 1."""

    frequency_hz: float
    quality: float


@dataclass(frozen=True, slots=True, eq=False)
class _System:
    """x' = A x + b u in modal form, A = V diag(rates) V^-1; at rest x = rest u."""

    rates: NDArray[np.complex128]
    vectors: NDArray[np.complex128]
    inverse: NDArray[np.complex128]
    rest: NDArray[np.float64]

    def decay(self, deviation: States, dt_s: float) -> States:
        """Return what is left of a deviation (7, k) from rest after `dt_s`."""
        modal = self.inverse @ deviation
        return np.asarray((self.vectors @ (np.exp(self.rates * dt_s)[:, None] * modal)).real)


def bessel_polynomial(order: int) -> NDArray[np.float64]:
    """Return the denominator of a Bessel low-pass with -3 dB at 1 rad/s, (order + 1,), the constant first.

    The reverse Bessel polynomial (Thomson 1949), its frequency scaled. Written out because scipy.signal takes
    1.5 s to load, and every start of a server would wait for it.
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
    # Scaling A and b together keeps the states at rest independent of the cut-off: a change of filter clock
    # in mid-flight leaves what the capacitors hold.
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
    """Since `t_ns` the inputs are constant; `deviation` is what was left of earlier moves then."""

    t_ns: int
    inputs: NDArray[np.float64]
    system: _System
    deviation: States

    def states(self, t_ns: int) -> States:
        rest = np.outer(self.system.rest, self.inputs)
        return rest + self.system.decay(self.deviation, max(0, t_ns - self.t_ns) * 1e-9)


class DriveHistory:
    """What the mode of each axis follows, for every moment of the last seconds; not thread safe."""

    def __init__(self, *, axes: int, mode: ResonantMode, cutoff_hz: int, t_ns: int) -> None:
        self._mode = mode
        self._cutoff_hz = cutoff_hz
        system = _system(cutoff_hz, mode)
        still = np.zeros((FILTER_ORDER + 2, axes))
        self._segments = [_Segment(t_ns, np.zeros(axes), system, still)]
        self._times_ns = [t_ns]

    def drive(self, t_ns: int, inputs_v: NDArray[np.float64]) -> None:
        """Hold the inputs (k,), volts, from `t_ns` on; events come in order of time."""
        self._turn(t_ns, np.array(inputs_v, dtype=np.float64), _system(self._cutoff_hz, self._mode))

    def low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        """Run the filter at another cut-off from `t_ns` on."""
        self._cutoff_hz = cutoff_hz
        self._turn(t_ns, self._segments[-1].inputs, _system(cutoff_hz, self._mode))

    def output_v(self, t_ns: int) -> NDArray[np.float64]:
        """Return what the mode has made of the inputs at `t_ns`: (k,) volts."""
        return np.asarray(self._segment(t_ns).states(t_ns)[FILTER_ORDER], dtype=np.float64)

    def _segment(self, t_ns: int) -> _Segment:
        return self._segments[max(0, bisect_right(self._times_ns, t_ns) - 1)]

    def _turn(self, t_ns: int, inputs: NDArray[np.float64], system: _System) -> None:
        last = self._segments[-1]
        t_ns = max(t_ns, last.t_ns)
        states = last.states(t_ns)
        self._segments.append(_Segment(t_ns, inputs, system, states - np.outer(system.rest, inputs)))
        self._times_ns.append(t_ns)
        self._forget(t_ns - KEEP_NS)

    def _forget(self, before_ns: int) -> None:
        old = bisect_right(self._times_ns, before_ns) - 1
        if old > 256:  # in lumps, so that a thousand writes a second do not each shift the lists
            del self._segments[:old]
            del self._times_ns[:old]
