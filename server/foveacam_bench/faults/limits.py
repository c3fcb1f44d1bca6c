"""Send thousands of invalid commands to the mirrors' driver: no voltage may leave the limits."""

import math
import random
from collections.abc import Callable

from foveacam_bench.faults.tally import FaultTally, LimitCables
from foveacam_hardware.contract import (
    FoveaError,
    InvalidInput,
    MirrorLimits,
    MirrorVolts,
    OutOfRange,
    StereoVolts,
    VirtualClock,
)
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackController

SEQUENCES, QUICK_SEQUENCES = 10_000, 500
RIG_SEQUENCES = 250
"""Sequences on one rig; the next rig has other limits."""
DAC_STEP_V = 0.01
"""Margin for the DAC's rounding below the largest drive that the bias allows."""
SEED = 20_261
ODD_V = (
    *(math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, -0.0, 10**400, -(10**400)),
    *(170.0, -170.0, 170.0 + 1e-9, -170.1, 200.0, 65_535, 2**63, 1e-300),
)
ODD_US = (0, -1, 1, 100, 4000, 2**32 - 1, 2**32, 2**63, 10**30)
ODD_HZ = (0, -5, 1, 60, 120, 340, 1000, 1001, 2**16, 10**30)


def measure(tally: FaultTally, quick: bool) -> dict[str, float | int | bool]:
    """Send the commands; return how many there were and how many were refused."""
    rng = random.Random(SEED)  # noqa: S311 - not a secret
    counts = {"command_sequences": 0, "commands": 0, "commands_refused": 0, "commands_unforeseen": 0}
    total = QUICK_SEQUENCES if quick else SEQUENCES
    for first in range(0, total, RIG_SEQUENCES):
        tally.add_violations(_one_rig(rng, min(RIG_SEQUENCES, total - first), counts))
    return dict(counts)


def _one_rig(rng: random.Random, sequences: int, counts: dict[str, int]) -> int:
    limits = _limits(rng)
    clock, cables = VirtualClock(1_000_000_000), LimitCables(limits)
    mirrors = ControllerMirrors(LoopbackController(clock, cables, strict=True).open, clock, limits)
    mirrors.connect()
    for _ in range(sequences):
        counts["command_sequences"] += 1
        for _ in range(rng.randint(1, 5)):
            counts["commands"] += 1
            try:
                _command(rng, mirrors, limits)()
            except (OutOfRange, InvalidInput):
                counts["commands_refused"] += 1
            except FoveaError:
                mirrors.connect()
            except Exception:  # noqa: BLE001 - counts every error outside the contract
                counts["commands_unforeseen"] += 1
        mirrors.connect()
        mirrors.enable()
    mirrors.close()
    return cables.violations


def _limits(rng: random.Random) -> MirrorLimits:
    bias_v = rng.choice((80.0, 90.0, rng.uniform(60.0, 100.0)))
    max_v = rng.choice((158.0, 170.0, rng.uniform(20.0, 170.0)))
    slew_v = rng.choice((400.0, 400.0, rng.uniform(10.0, 200.0)))
    return MirrorLimits(bias_v=bias_v, max_v=min(max_v, 2 * bias_v - DAC_STEP_V), max_slew_v=slew_v)


def _command(rng: random.Random, mirrors: ControllerMirrors, limits: MirrorLimits) -> Callable[[], object]:
    kind = rng.choices(
        ("steer", "expose", "park", "enable", "disable", "low pass", "recover"), (10, 4, 1, 1, 1, 1, 1)
    )[0]
    volts = _stereo(rng, limits)
    settle_us = rng.choice((0, 100, rng.choice(ODD_US)))
    pulse_us = rng.choice((1000, 4000, rng.choice(ODD_US)))
    if settle_us > 10**6 or pulse_us > 10**6:  # an accepted one would last an hour
        settle_us, pulse_us = max(settle_us, 2**32), max(pulse_us, 2**32)
    cutoff_hz = rng.choice(ODD_HZ)
    commands: dict[str, Callable[[], object]] = {
        "steer": lambda: mirrors.steer(volts),
        "expose": lambda: mirrors.expose(volts, settle_us=settle_us, pulse_us=pulse_us),
        "park": mirrors.park,
        "enable": mirrors.enable,
        "disable": mirrors.disable,
        "low pass": lambda: mirrors.set_low_pass(cutoff_hz),
        "recover": mirrors.recover,
    }
    return commands[kind]


def _stereo(rng: random.Random, limits: MirrorLimits) -> StereoVolts:
    values = [_value_v(rng, limits) for _ in range(4)]
    return StereoVolts(
        left=MirrorVolts(x_v=values[0], y_v=values[1]), right=MirrorVolts(x_v=values[2], y_v=values[3])
    )


def _value_v(rng: random.Random, limits: MirrorLimits) -> float:
    kind = rng.random()
    if kind < 0.7:
        return rng.uniform(-limits.max_v, limits.max_v)
    if kind < 0.85:
        return rng.uniform(-1.3, 1.3) * limits.max_v
    if kind < 0.92:
        return rng.choice((limits.max_v, -limits.max_v, math.nextafter(limits.max_v, math.inf)))
    return rng.choice(ODD_V)
