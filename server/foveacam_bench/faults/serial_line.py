"""Seeded faults on the controller's line under the server's hardware thread, on ptys and in real time.

A sequence is one to three faults in a row while the mirrors are steered: cut, garbage, half a packet,
silence, a controller that stops until it is switched off and on. A fault is detected when the server reports
it, and recovered when a position is confirmed again; nothing on the host is restarted.
"""

import random
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeAlias

from foveacam_bench.faults.hardware_host import BenchHost, controller_rig, seconds_until, sleep_until
from foveacam_bench.faults.killed_host import random_volts
from foveacam_bench.faults.tally import FaultTally, LimitCables
from foveacam_hardware.contract import FoveaError, MirrorLimits, Mirrors, StereoVolts
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_hardware.sim.far_ends.line_faults import DamageKind, LineDamage

NUMBERS, QUICK_NUMBERS = tuple(range(100)), (1, 5, 6, 7)
"""Sequences by number; the quick ones begin with silence, half a packet, a controller that stops, a cut."""
WORKERS, QUICK_WORKERS = 4, 2
SEED = 404
SILENCE_S = 5.0
CUT_S = (0.1, 2.0)
NOTICE_S, HARMLESS_S, RECOVER_S = 5.0, 1.5, 15.0
"""Longest waits: for faults that must be detected, for faults that may have no effect, for the recovery."""
STEER_PERIOD_S = 0.02
ANSWER_S = 5.0
_Fault: TypeAlias = tuple[Callable[[int], None], bool]
"""Function that restores the device, called with the time of the fault; whether it must be detected."""


def measure(tally: FaultTally, quick: bool) -> dict[str, float | int | bool]:
    """Run the sequences on several controllers in parallel; their outcome is in the tally."""
    numbers = QUICK_NUMBERS if quick else NUMBERS
    workers = QUICK_WORKERS if quick else WORKERS
    shares = [numbers[first::workers] for first in range(workers)]
    with ThreadPoolExecutor(workers) as pool:
        for done in [pool.submit(_run_share, tally, share, quick) for share in shares]:
            done.result()
    return {}


def _run_share(tally: FaultTally, numbers: Sequence[int], quick: bool) -> None:
    for number in numbers:
        rng = random.Random(SEED + number)  # noqa: S311 - not a secret
        cables = LimitCables(MirrorLimits())
        with (
            ControllerProcess(cables, strict=bool(number % 2)) as controller,
            BenchHost(controller_rig(controller.port)) as host,
        ):
            line = _Line(controller, cables, host, rng)
            for _ in range(rng.randint(1, 3)):
                line.cause_fault(tally, silence_s=1.5 if quick else SILENCE_S)
        tally.add_violations(cables.violations)
        tally.add_sequence()


class _Line:
    """A controller, its host, and the faults on the line between them."""

    def __init__(
        self, controller: ControllerProcess, cables: LimitCables, host: BenchHost, rng: random.Random
    ) -> None:
        self._controller = controller
        self._cables = cables
        self._host = host
        self._rng = rng
        self._lost_before = 0

    def cause_fault(self, tally: FaultTally, *, silence_s: float) -> None:
        """Cause one fault while positions are steered; measure detection and recovery."""
        kinds = (self._cut, self._silence, self._garbage, self._garbage, self._half, self._stop)
        fault = self._rng.choice(kinds)
        with _Steering(self._host, self._rng) as steering:
            time.sleep(self._rng.uniform(0.05, 0.4))
            self._lost_before = self._host.mirrors.telemetry.lost_answers
            began_ns = time.monotonic_ns()
            restore, certain = fault(silence_s)
            detected_s = seconds_until(
                self._is_detected, since_ns=began_ns, within_s=NOTICE_S if certain else HARMLESS_S
            )
            steering.set()
        restore(began_ns)
        if self._controller.status().dead:
            self._controller.power_cycle()
        self._controller.heal()
        back_ns = time.monotonic_ns()
        recovered_s = seconds_until(self._is_recovered, since_ns=back_ns, within_s=RECOVER_S)
        if detected_s is None and (certain or recovered_s is None):
            tally.add_hang()
            return
        self._controller.status()  # waits until all events of the cables have arrived
        parked = self._cables.rested_since(began_ns)
        tally.add_fault(
            kind=f"line_{fault.__name__.strip('_')}",
            detected_s=detected_s,
            recovered_s=recovered_s,
            parked=parked,
        )

    def _is_detected(self) -> bool:
        lost = self._host.mirrors.telemetry.lost_answers
        return self._host.mirrors_faulty or lost > self._lost_before

    def _is_recovered(self) -> bool:
        """Return whether the controller confirms a commanded position again."""
        if self._host.mirrors_faulty:
            return False
        try:
            volts = self._host.run_on_mirrors(
                lambda mirrors: mirrors.steer(random_volts(self._rng)), timeout_s=ANSWER_S
            )
            self._host.run_on_mirrors(lambda mirrors: mirrors.ping(), timeout_s=ANSWER_S)
        except (FoveaError, TimeoutError):
            return False
        return self._host.mirrors.state.volts == volts

    def _cut(self, _silence_s: float) -> _Fault:
        self._controller.unplug(keep_power=self._rng.random() < 0.5)
        pause_s = self._rng.uniform(*CUT_S)

        def plug(began_ns: int) -> None:
            sleep_until(began_ns, pause_s)
            self._controller.plug()

        return plug, True

    def _silence(self, silence_s: float) -> _Fault:
        self._controller.configure(silent=True)

        def end_silence(began_ns: int) -> None:
            sleep_until(began_ns, silence_s)
            self._controller.configure(silent=False)

        return end_silence, True

    def _garbage(self, _silence_s: float) -> _Fault:
        damage = self._rng.choice((self._controller.damage_to_host, self._controller.damage_to_device))
        for _ in range(self._rng.randint(1, 6)):
            kind = self._rng.choice((DamageKind.INSERT, DamageKind.CORRUPT))
            count, value = self._rng.randint(1, 30), self._rng.randint(1, 255)
            damage(LineDamage(kind=kind, skip=self._rng.randint(0, 40), count=count, value=value))
        return _nothing, False

    def _half(self, _silence_s: float) -> _Fault:
        damage = self._rng.choice((self._controller.damage_to_host, self._controller.damage_to_device))
        damage(
            LineDamage(kind=DamageKind.DROP, skip=self._rng.randint(1, 20), count=self._rng.randint(1, 30))
        )
        return _nothing, False

    def _stop(self, _silence_s: float) -> _Fault:
        self._controller.die()
        return _nothing, True  # `cause_fault` switches a dead controller off and on


class _Steering:
    """Steers positions at 50 Hz while the context lasts, until stopped."""

    def __init__(self, host: BenchHost, rng: random.Random) -> None:
        self._host = host
        self._rng = random.Random(rng.random())  # noqa: S311 - not a secret
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="bench-steering", daemon=True)

    def __enter__(self) -> threading.Event:
        self._thread.start()
        return self._over

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._over.wait(STEER_PERIOD_S):
            try:
                volts = random_volts(self._rng)
                self._host.run_on_mirrors(partial(_steer, volts), timeout_s=ANSWER_S)
            except (FoveaError, TimeoutError):
                continue  # expected during a fault


def _nothing(_began_ns: int) -> None:
    """Do nothing: `cause_fault` repairs the line after every fault."""


def _steer(volts: StereoVolts, mirrors: Mirrors) -> StereoVolts:
    return mirrors.steer(volts)
