"""Resonance of a mirror from its motion after a step, and the wait after a large move that follows from it.

The model is the drive filter, the board's Bessel low-pass of the fifth order with a known cut-off, followed
by one damped mode: what the filter does not explain is the mirror's.
"""

import copy
import math

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.robust_least_squares import (
    LeastSquaresFit,
    ResidualModel,
    fit_least_squares,
)
from foveacam_pipeline.calibrate.settle.settle_values import (
    AxisSettle,
    MirrorResonance,
    SettleReport,
    StepTrace,
)

FILTER_ORDER = 5
EXPOSURE_PARTS = 7
FREQUENCIES_HZ = np.geomspace(250.0, 5000.0, 120)
QUALITIES = (0.8, 2.0, 5.0, 15.0, 50.0)
MIN_QUALITY = 0.75
"""Below this quality the overshoot cannot be distinguished from a slower filter."""
MIN_GAIN = 4.0
"""Minimum ratio of the residuals without the mode to those with it."""
MIN_PICTURES = 12
MIN_NOISE_PX = 0.03
STARTS = 3
MISS_CAP = 30.0
"""Upper limit of a picture's residual when start values are compared, standard errors."""
BLUR_SHARE = 0.15
"""Position error of a picture that moved during its exposure, as a share of the motion."""
MISTAKEN_RATIO = 400.0
"""Squared residual of a mismatched picture over the median one: twenty times the median residual."""
LARGEST_REL_SIGMA = 0.25
MODEL_SHARE = 0.01
"""Error of the model as a share of the remaining step: pictures rotate and blur slightly on the way."""
NOT_RESOLVED = "not resolvable"
WAIT_STEP_US = 100.0
"""Waits are rounded up to this step."""
MODEL_SPAN_US = 200_000.0
MODEL_STEP_US = 10.0


def fit_resonance(
    trace: StepTrace, *, step_px: float, cutoff_hz: int, exposure_us: float, noise_px: float
) -> tuple[MirrorResonance | None, str]:
    """Return the resonance of a trace, or None, and a sentence about it."""
    if len(trace.times_us) < MIN_PICTURES:
        return None, f"{NOT_RESOLVED}: only {len(trace.times_us)} pictures were recognised"
    data = _StepData(
        np.array(trace.times_us) / 1e6,
        np.array(trace.left_px) / step_px,
        exposure_s=exposure_us / 1e6,
        noise=max(noise_px, MIN_NOISE_PX) / step_px,
    )
    filtering = _filter_poles(float(cutoff_hz))
    alone = _fit_terms(data, filtering, [[0.0]])
    rough = _fit_terms(data, filtering, _start_terms(data, filtering))
    fit = _fit_terms(
        data.with_motion_error(_combined_poles(filtering, rough.terms), delay_s=float(rough.terms[0])),
        filtering,
        [rough.terms.tolist()],
    )
    frequency, quality = (math.exp(v) for v in fit.terms[1:3].tolist())
    _, *sigmas = _rel_sigmas(fit)
    moves = data.gain(filtering, fit.terms, alone.terms) >= MIN_GAIN
    if moves and quality < MIN_QUALITY:  # only the ratio of frequency and quality is determined
        return None, f"{NOT_RESOLVED}: the mirror is damped (quality {quality:.2f}) and does not ring"
    if not moves or max(sigmas) > 1.0:
        return None, f"{NOT_RESOLVED}: the drive filter alone explains what the mirror does"
    if max(sigmas) > LARGEST_REL_SIGMA:
        return None, f"{NOT_RESOLVED}: {max(sigmas):.0%} of error; use more delays or a larger step"
    found = MirrorResonance(
        frequency_hz=frequency,
        quality=quality,
        frequency_sigma_hz=frequency * sigmas[0],
        quality_sigma=quality * sigmas[1],
    )
    return found, (
        f"{frequency:.0f} ± {found.frequency_sigma_hz:.0f} Hz, "
        f"quality {quality:.1f} ± {found.quality_sigma:.1f}"
    )


class _StepData:
    """The remaining share of the step at each time, and a model's residuals against it."""

    def __init__(
        self, times_s: NDArray[np.float64], left: NDArray[np.float64], *, exposure_s: float, noise: float
    ) -> None:
        self._left = left
        self._sigma = np.hypot(noise, MODEL_SHARE * np.abs(left))
        parts = (np.arange(EXPOSURE_PARTS) + 0.5) / EXPOSURE_PARTS - 0.5
        self._moments_s = times_s[:, None] + exposure_s * parts

    def with_motion_error(self, poles: NDArray[np.complex128], *, delay_s: float) -> "_StepData":
        """Return the same data with larger errors where the picture moved during its exposure."""
        span = np.ptp(remaining_step(poles, self._moments_s - delay_s), axis=1)
        widened = copy.copy(self)
        widened._sigma = np.hypot(self._sigma, BLUR_SHARE * span)  # noqa: SLF001 - our own copy
        return widened

    def residuals(self, poles: NDArray[np.complex128], *, delay_s: float) -> NDArray[np.float64]:
        """Return the (n,) residuals in standard errors; a picture shows the mean over its exposure."""
        return np.asarray(self._miss(poles, delay_s) / self._sigma, dtype=np.float64)

    def gain(
        self, filtering: NDArray[np.complex128], found: NDArray[np.float64], other: NDArray[np.float64]
    ) -> float:
        """Return the ratio of squared residuals of `other` to `found`, without wrongly matched pictures."""
        first, second = (
            self._miss(_combined_poles(filtering, terms), float(terms[0])) ** 2 for terms in (found, other)
        )
        bulk = first <= MISTAKEN_RATIO * max(float(np.median(first)), float(np.min(self._sigma)) ** 2)
        return float(np.sum(second[bulk]) / np.sum(first[bulk]))

    def _miss(self, poles: NDArray[np.complex128], delay_s: float) -> NDArray[np.float64]:
        model = remaining_step(poles, self._moments_s - delay_s).mean(axis=1)
        return np.asarray(model - self._left, dtype=np.float64)


def remaining_step(poles: NDArray[np.complex128], times_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the remaining share of a unit step of an all-pole system of gain 1 at `times_s`, any shape."""
    apart = poles[:, None] - poles[None, :]
    np.fill_diagonal(apart, 1.0)
    shares = -np.prod(-poles) / (poles * np.prod(apart, axis=1))
    after = np.maximum(times_s, 0.0)
    left = np.sum(shares * np.exp(poles * after[..., None]), axis=-1).real
    return np.asarray(np.where(times_s > 0.0, left, 1.0), dtype=np.float64)


def _filter_poles(cutoff_hz: float) -> NDArray[np.complex128]:
    """Return the poles of the filter, 1/s."""
    from scipy import signal  # slow to import

    _, poles, _ = signal.bessel(
        FILTER_ORDER, 2.0 * math.pi * cutoff_hz, analog=True, output="zpk", norm="mag"
    )
    return np.asarray(poles, dtype=np.complex128)


def system_poles(cutoff_hz: float, resonance: MirrorResonance | None) -> NDArray[np.complex128]:
    """Return the poles, 1/s, of the drive filter and of the mirror's mode behind it, if that is known."""
    terms = [0.0]
    if resonance is not None:
        terms += [math.log(resonance.frequency_hz), math.log(resonance.quality)]
    return _combined_poles(_filter_poles(cutoff_hz), np.array(terms))


def _combined_poles(filtering: NDArray[np.complex128], terms: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return the poles of the filter and of a mode behind it, by (delay[, ln frequency, Hz, ln quality])."""
    if len(terms) == 1:
        return filtering
    omega, quality = 2.0 * math.pi * math.exp(terms[1]), math.exp(terms[2])
    damping = omega / (2.0 * quality)
    swing = complex(np.sqrt(complex(omega**2 - damping**2))) + 1e-6 * omega  # two equal poles have no modes
    return np.append(filtering, [-damping + 1j * swing, -damping - 1j * swing])


def _start_terms(data: _StepData, filtering: NDArray[np.complex128]) -> list[list[float]]:
    """Return the best starts of a grid of frequencies and qualities."""
    tried = []
    for frequency in FREQUENCIES_HZ.tolist():
        for quality in QUALITIES:
            start = [0.0, math.log(frequency), math.log(quality)]
            miss = data.residuals(_combined_poles(filtering, np.array(start)), delay_s=0.0)
            tried.append((float(np.sum(np.minimum(np.abs(miss), MISS_CAP))), start))
    return [start for _, start in sorted(tried)[:STARTS]]


def _fit_terms(
    data: _StepData, filtering: NDArray[np.complex128], starts: list[list[float]]
) -> LeastSquaresFit:
    """Return the best robust fit of the delay, and of a mode if the starts have one."""

    def miss(terms: NDArray[np.float64]) -> NDArray[np.float64]:
        return data.residuals(_combined_poles(filtering, terms), delay_s=float(terms[0]))

    model = ResidualModel(residuals=miss, term_scales=np.array([1e-4, 0.05, 0.2][: len(starts[0])]))
    fits = [fit_least_squares(model, np.array(start), loss="soft_l1") for start in starts]
    return min(fits, key=lambda fit: fit.cost)


def _rel_sigmas(fit: LeastSquaresFit) -> list[float]:
    """Return the standard errors of a fit's terms, scaled by the scatter of the data."""
    free = max(1, len(fit.residuals) - len(fit.terms))
    variance = max(1.0, 2.0 * fit.cost / free)
    sigmas: list[float] = np.sqrt(variance * np.diag(fit.covariance())).tolist()
    return sigmas


def settle_wait_us(report: SettleReport, *, max_v: float) -> int:
    """Return the wait, µs, for the largest move, -`max_v` to `max_v`, to be within the limit on all axes."""
    longest_us = max(largest_move_us(report, axis, move_v=2.0 * max_v) for axis in report.axes)
    return round(WAIT_STEP_US * math.ceil(longest_us / WAIT_STEP_US))


def largest_move_us(report: SettleReport, axis: AxisSettle, *, move_v: float) -> float:
    """Return the time after which a move of `move_v` along one axis stays within the limit, µs.

    It is never less than was measured for the smaller step. Filter and mirror are linear, so that their poles
    give the additional time of a move larger than the measured step of about a degree.
    """
    move_px = abs(axis.step_px) * move_v / abs(axis.step_v)
    if report.low_pass_hz is None or move_px <= abs(axis.step_px):
        return max(axis.settle_us, axis.settle_for_us(max(move_px, abs(axis.step_px))))
    small_us, large_us = (
        _modelled_settle_us(report.low_pass_hz, axis, share=report.limit_px / px)
        for px in (abs(axis.step_px), move_px)
    )
    return axis.settle_us + max(0.0, large_us - small_us)


def _modelled_settle_us(low_pass_hz: int, axis: AxisSettle, *, share: float) -> float:
    """Return the time after which less than a share of a step remains by filter and mirror, µs."""
    times_us = np.arange(0.0, MODEL_SPAN_US, MODEL_STEP_US)
    left = np.abs(remaining_step(system_poles(float(low_pass_hz), axis.resonance), 1e-6 * times_us))
    above = np.flatnonzero(left > share)
    return float(times_us[above[-1]]) if len(above) else 0.0
