"""Seeded faults of a simulated rig's cameras and cables under the server's hardware thread, in real time.

A disconnected camera, strobe cable or trigger cable; looks continue as with a viewer connected.
"""

import random
import time
from dataclasses import replace

from foveacam_bench.faults.hardware_host import BenchHost, seconds_until, sleep_until
from foveacam_bench.faults.killed_host import random_volts
from foveacam_bench.faults.tally import FaultTally, LimitCables
from foveacam_hardware.contract import FoveaError, MirrorLimits, PixelFormat, Role
from foveacam_hardware.rig import open_rig
from foveacam_hardware.rig_config import SimulatedRigConfig
from foveacam_hardware.sim.cables import DacCodes
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.world import World
from foveacam_server.resources.studying.studies.click_truth import truth_of
from foveacam_server.rig.ports import AssembledRig as RigPort

SEQUENCES, QUICK_SEQUENCES = 18, 3
SEED = 1818
KINDS = ("strobe_missing", "camera_unplugged", "trigger_missing")
AWAY_S = (0.3, 3.0)
NOTICE_S, RECOVER_S = 5.0, 15.0
PARK_S, ANSWER_S = 1.5, 5.0
RATE_HZ = 6.0
EYES = (Role.LEFT, Role.RIGHT)
DEVICES = ("mirrors", "wide", "left", "right")


def measure(tally: FaultTally, quick: bool) -> dict[str, float | int | bool]:
    """Run the sequences on one rig; the kinds alternate."""
    warm_up()
    rig = open_rig(SimulatedRigConfig())
    cables = LimitCables(MirrorLimits())
    world = truth_of(rig).world
    _record_drives(world, cables)
    with BenchHost(rig, rate_hz=RATE_HZ) as host:
        host.hardware.submit(_use_grey_pictures).result(ANSWER_S)
        for number in range(QUICK_SEQUENCES if quick else SEQUENCES):
            rng = random.Random(SEED + number)  # noqa: S311 - not a secret
            kind = KINDS[number % len(KINDS)]
            for _ in range(1 if quick else rng.randint(1, 2)):
                _RigFault(world, cables, host, rng, kind).cause_fault(tally)
            tally.add_sequence()
    tally.add_violations(cables.violations)
    return {}


def _use_grey_pictures(rig: RigPort) -> None:
    """Switch every camera to grey pictures, which are rendered in a fraction of the time."""
    for camera in (rig.wide, rig.left, rig.right):
        camera.configure(replace(camera.settings, pixel_format=PixelFormat.MONO8))


def _record_drives(world: World, cables: LimitCables) -> None:
    """Let `cables` record the drives of the world's mirrors."""
    set_codes = world.set_codes

    def set_and_record(t_ns: int, codes: DacCodes) -> None:
        cables.set_codes(t_ns, codes)
        set_codes(t_ns, codes)

    world.set_codes = set_and_record  # type: ignore[method-assign]  # the far end calls the world's own


class _RigFault:
    """Causes and ends one fault of one kind."""

    def __init__(
        self, world: World, cables: LimitCables, host: BenchHost, rng: random.Random, kind: str
    ) -> None:
        self._cables = cables
        self._host = host
        self._rng = rng
        self._kind = kind
        faults = world.faults
        sets = {
            "strobe_missing": (faults.no_strobe, EYES),
            "camera_unplugged": (faults.unplugged, tuple(Role)),
            "trigger_missing": (faults.no_trigger, EYES),
        }
        self._set, roles = sets[kind]
        self._role = rng.choice(roles)

    def cause_fault(self, tally: FaultTally) -> None:
        """Cause the fault and end it; measure the times of its detection and of the next successful look."""
        if seconds_until(self._is_recovered, since_ns=time.monotonic_ns(), within_s=RECOVER_S) is None:
            tally.add_hang()
            return
        time.sleep(self._rng.uniform(0.0, 0.3))
        began_ns = time.monotonic_ns()
        self._set.add(self._role)
        detected_s = seconds_until(self._is_reported, since_ns=began_ns, within_s=NOTICE_S)
        parked_s = seconds_until(
            lambda: self._cables.rested_since(began_ns), since_ns=time.monotonic_ns(), within_s=PARK_S
        )
        sleep_until(began_ns, self._rng.uniform(*AWAY_S))
        self._set.discard(self._role)
        back_ns = time.monotonic_ns()
        recovered_s = seconds_until(lambda: not self._is_reported(), since_ns=back_ns, within_s=RECOVER_S)
        if detected_s is None:
            tally.add_hang()
            return
        tally.add_fault(
            kind=self._kind, detected_s=detected_s, recovered_s=recovered_s, parked=parked_s is not None
        )

    def _is_reported(self) -> bool:
        return self._host.has_problem(*DEVICES)

    def _is_recovered(self) -> bool:
        """Return whether a look away from the rest position succeeds."""
        try:
            with self._host.hardware.session("a look", cancelled=lambda: False) as head:
                head.look(random_volts(self._rng))
        except FoveaError:
            return False
        return not self._is_reported()
