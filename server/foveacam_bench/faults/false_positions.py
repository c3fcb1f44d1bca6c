"""Random sequences of commands, silence, restarts, alarms and cut cables, on virtual time.

Counts the sequences in which a pan-tilt, a rail or the mirrors claim a position that is not the true one, and
those that do not end usable.
"""

import random

from foveacam_bench.faults.mirror_trial import STEPS as MIRROR_STEPS
from foveacam_bench.faults.mirror_trial import MirrorTrial
from foveacam_bench.faults.positioner_trial import KINDS, STEPS, WAITS_S, PositionerTrial
from foveacam_bench.faults.tally import FaultTally
from foveacam_bench.faults.trial_checks import FalsePosition, TrialFailed
from foveacam_hardware.contract import FoveaError

RUNS, QUICK_RUNS = 2000, 25
MIRROR_RUNS, QUICK_MIRROR_RUNS = 500, 10
SEED = 4040
LEAST_STEPS, MOST_STEPS = 4, 14
HOMED_SHARE, HOMING_S = 0.8, 6.0


def measure(tally: FaultTally, quick: bool) -> dict[str, float | int | bool]:
    """Run the sequences; return how many there were, and in how many a false position was claimed."""
    runs, mirror_runs = (QUICK_RUNS, QUICK_MIRROR_RUNS) if quick else (RUNS, MIRROR_RUNS)
    return {
        "false_homed": sum(_positioner_fails(tally, number) for number in range(runs)),
        "false_homed_runs": runs,
        "false_volts": sum(_mirrors_fail(tally, number) for number in range(mirror_runs)),
        "false_volts_runs": mirror_runs,
    }


def _positioner_fails(tally: FaultTally, number: int) -> bool:
    """Run one sequence of a positioner; return whether it claimed a false position."""
    rng = random.Random(SEED + number)  # noqa: S311 - not a secret
    trial = PositionerTrial(KINDS[number % len(KINDS)])
    try:
        trial.connect()
        if rng.random() < HOMED_SHARE:
            trial.home()
            trial.confirm_zero()
            trial.wait(rng.choice((0.5, HOMING_S)))
        for _ in range(rng.randint(LEAST_STEPS, MOST_STEPS)):
            _positioner_step(trial, rng)
            trial.check()
        trial.recover()
    except FalsePosition:
        return True
    except (TrialFailed, FoveaError):  # it contradicts itself elsewhere, or is unusable
        tally.add_hang()
    return False


def _positioner_step(trial: PositionerTrial, rng: random.Random) -> None:
    kind = rng.choices(("move", "wait", "look away", "other"), (5, 5, 2, 8))[0]
    match kind:
        case "move":
            trial.move(rng.uniform(-1.0, 1.0))
        case "wait":
            trial.wait(rng.choice(WAITS_S))
        case "look away":
            trial.look_away(rng.choice(WAITS_S))
        case _:
            rng.choice(STEPS)(trial)


def _mirrors_fail(tally: FaultTally, number: int) -> bool:
    """Run one sequence of the mirrors; return whether they claimed false volts."""
    rng = random.Random(SEED + number)  # noqa: S311 - not a secret
    trial = MirrorTrial(strict=bool(number % 2))
    try:
        trial.connect()
        for _ in range(rng.randint(LEAST_STEPS, MOST_STEPS)):
            _mirror_step(trial, rng)
            trial.check()
        trial.recover()
    except FalsePosition:
        return True
    except (TrialFailed, FoveaError):
        tally.add_hang()
    finally:
        trial.close()
    return False


def _mirror_step(trial: MirrorTrial, rng: random.Random) -> None:
    kind = rng.choices(("steer", "expose", "wait", "other"), (5, 2, 3, 10))[0]
    match kind:
        case "steer":
            trial.steer(rng.uniform(-1.0, 1.0))
        case "expose":
            trial.expose(rng.uniform(-1.0, 1.0))
        case "wait":
            trial.wait(rng.choice(WAITS_S))
        case _:
            rng.choice(MIRROR_STEPS)(trial)
