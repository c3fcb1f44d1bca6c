"""Converts volts to DAC codes and back, and checks the limits that the controller does not enforce."""

import math
from numbers import Integral

from foveacam_hardware.contract import InvalidInput, MirrorLimits, MirrorVolts, OutOfRange, StereoVolts
from foveacam_hardware.wire.controller_payloads import (
    DAC_FULL_SCALE,
    DAC_FULL_SCALE_V,
    MirrorCodes,
    code_of_volts,
)

HALF_STEP_V = DAC_FULL_SCALE_V / DAC_FULL_SCALE / 2.0
"""Rounding error of a drive: a drive at its limit, once read back, may be commanded again."""


def bias_code(limits: MirrorLimits) -> int:
    """Return the DAC code of the bias; raise `InvalidInput` when bias and swing leave the DAC's range."""
    code = code_of_volts(limits.bias_v)
    swing_codes = (
        round(limits.max_v * DAC_FULL_SCALE / DAC_FULL_SCALE_V) + 1
    ) // 2  # as `_pair_codes` rounds
    if not 0 <= code - swing_codes <= code + swing_codes <= DAC_FULL_SCALE:
        raise InvalidInput(
            f"mirror limits: {limits.bias_v} ± {limits.max_v / 2} V leaves the DAC's"
            f" 0..{DAC_FULL_SCALE_V:.0f} V; lower max_v or correct bias_v"
        )
    return code


def mirror_codes(volts: MirrorVolts, *, bias: int) -> MirrorCodes:
    """Return the codes x+, x−, y+, y− nearest to the differential volts about the bias code."""
    return *_pair_codes(volts.x_v, bias=bias), *_pair_codes(volts.y_v, bias=bias)


def mirror_volts(codes: MirrorCodes) -> MirrorVolts:
    """Return the differential volts of four codes."""
    x_plus, x_minus, y_plus, y_minus = codes
    step_v = DAC_FULL_SCALE_V / DAC_FULL_SCALE
    return MirrorVolts(x_v=(x_plus - x_minus) * step_v, y_v=(y_plus - y_minus) * step_v)


def check_limits(volts: StereoVolts, *, before: StereoVolts, limits: MirrorLimits) -> None:
    """Raise `OutOfRange` for a drive that is not finite, too high, or too far from the previous one."""
    asked = _axes(volts)
    for (name, value_v), (_, before_v) in zip(asked, _axes(before), strict=True):
        if (
            value_v != value_v or abs(value_v) == math.inf
        ):  # NaN is not itself; isfinite fails on huge integers
            raise OutOfRange(f"mirror {name}: {value_v} is no voltage; give a finite number")
        if abs(value_v) > limits.max_v + HALF_STEP_V:
            raise OutOfRange(
                f"mirror {name}: {_format_volts(value_v)} V is outside ±{limits.max_v:g} V;"
                " aim nearer to the centre"
            )
        if abs(value_v - before_v) > limits.max_slew_v:
            raise OutOfRange(
                f"mirror {name}: a step of {value_v - before_v:+.3f} V in one update exceeds"
                f" {limits.max_slew_v:g} V; move in smaller steps"
            )


def is_whole(value: object) -> bool:
    """Return whether a value is an integer, numpy's included; the protocol has no other numbers."""
    return isinstance(value, Integral)


def _format_volts(value_v: float) -> str:
    return f"{value_v:.3f}" if abs(value_v) < 1e6 else "a million or more"


def _pair_codes(volts_v: float, *, bias: int) -> tuple[int, int]:
    # The difference is rounded once, so its error is half a code; rounding each half apart doubles it.
    difference = round(volts_v * DAC_FULL_SCALE / DAC_FULL_SCALE_V)
    plus = bias + (difference + 1) // 2
    return plus, plus - difference


def _axes(volts: StereoVolts) -> tuple[tuple[str, float], ...]:
    left, right = volts.left, volts.right
    return ("L x", left.x_v), ("L y", left.y_v), ("R x", right.x_v), ("R y", right.y_v)
