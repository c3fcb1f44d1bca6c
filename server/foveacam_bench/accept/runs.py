"""Acceptance of simulated rigs, sound ones and ones with a planted fault (`foveacam bench accept`)."""

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from foveacam_bench.accept.photo_sets import SETS, photo_set_figures
from foveacam_bench.accept.planted import PLANTED, PlantedFault
from foveacam_bench.figures import Figures, Report
from foveacam_bench.progress import show_part
from foveacam_hardware.rig_config import SimulatedRigConfig
from foveacam_hardware.sim.faults import ThermalMountDrift
from foveacam_hardware.sim.presets import PRESETS
from foveacam_hardware.sim.rig import simulated_rig
from foveacam_pipeline.accept.environment import AcceptanceOptions
from foveacam_pipeline.accept.run import run_acceptance
from foveacam_pipeline.accept.values import Acceptance
from foveacam_pipeline.calibrate.watcher import SilentWatcher
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.commands.rig import OwnRig
from foveacam_server.foundation.names import utc_now
from foveacam_server.resources.calibrating.acceptances.environment import environment_of_rig
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

SEED = 1
EACH = 5
"""Sound runs of each preset: of the calibrated rig with other drifts, and of other specimens."""
DRIFT_S = 600.0
"""A rig is accepted at a random time within ten minutes after its calibration."""
OPTIONS = AcceptanceOptions(looks=100, wide_s=10.0)
"""Less of the frames than in a run of the product, where a minute of them changes no other check."""
QUICK_FAULTS, QUICK_SETS = 3, 3


@dataclass(frozen=True, slots=True, kw_only=True)
class SoundRun:
    """A sound rig. `drift_seed`: None for a specimen of another seed, which has no calibration."""

    preset: str
    seed: int
    drift_seed: int | None

    @property
    def name(self) -> str:
        """Its name in the list of wrong ones."""
        return f"{self.preset}, seed {self.seed}, drift {self.drift_seed}"


def run(
    *, quick: bool = False, seed: int = SEED, data: Path | None = None, report: Report = lambda progress: None
) -> Figures:
    """Accept every planted and every sound rig, fit every set of photographs, and return the figures.

    `data`: a folder of real photographs, if any.
    """
    figures = planted_figures(PLANTED[:QUICK_FAULTS] if quick else PLANTED, report)
    show_part(figures)
    sound = list(sound_runs(np.random.default_rng(seed), count=1 if quick else EACH))
    figures |= sound_figures(sound[:1] if quick else sound, report)
    show_part(figures)
    figures |= {"run_s": _whole_run_s(report)}
    sets = SETS[:QUICK_SETS] if quick else SETS
    return figures | photo_set_figures(report, data=data, sets=sets)


def planted_figures(planted: tuple[PlantedFault, ...], report: Report) -> Figures:
    """Return how many planted faults were named, and nothing but them."""
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        for number, one in enumerate(planted, start=1):
            report(f"planted fault {number} of {len(planted)}: {one.name}")
            found = accepted(one.rig_file(Path(folder)), calibrated=True)
            named = {(each.fault, each.subject) for each in found.findings}
            if named != {one.named}:
                listed = ", ".join(sorted(f"{fault} {subject}".strip() for fault, subject in named))
                wrong.append(f"{one.name}: {listed or 'nothing'}")
    return {
        "planted_faults": len(planted),
        "planted_named": len(planted) - len(wrong),
        "planted_not_named": wrong,
    }


def sound_runs(rng: np.random.Generator, *, count: int) -> Iterator[SoundRun]:
    """Yield sound rigs of both presets, drawn by chance."""
    for preset in PRESETS:
        for _ in range(count):
            yield SoundRun(preset=preset, seed=0, drift_seed=int(rng.integers(2**31)))
        for _ in range(count):
            yield SoundRun(preset=preset, seed=int(rng.integers(1, 10_000)), drift_seed=None)


def sound_figures(sound: list[SoundRun], report: Report) -> Figures:
    """Return how many sound rigs had a fault named, and the longest run."""
    wrong, unmade = [], []
    for number, one in enumerate(sound, start=1):
        report(f"sound rig {number} of {len(sound)}: {one.name}")
        found = accepted(
            {"scene": "calibration", "preset": one.preset, "seed": one.seed},
            calibrated=one.drift_seed is not None,
            drift_seed=one.drift_seed,
        )
        if found.findings:
            listed = ", ".join(f"{each.fault} {each.subject}".strip() for each in found.findings)
            wrong.append(f"{one.name}: {listed}")
        elif one.drift_seed is not None and not found.accepted:
            unmade.append(one.name)
    return {
        "sound_runs": len(sound),
        "named_wrongly": len(wrong),
        "named_wrongly_on": wrong,
        "sound_not_accepted": unmade,
    }


def accepted(
    rig_file: dict[str, object],
    *,
    calibrated: bool,
    drift_seed: int | None = None,
    options: AcceptanceOptions = OPTIONS,
) -> Acceptance:
    """Return the acceptance of a simulated rig in virtual time.

    `calibrated`: with the calibration that ships for it. `drift_seed`: its mounts have drifted since then.
    """
    config = SimulatedRigConfig.model_validate(rig_file)
    rig = simulated_rig(config, inline=True)
    with rig:
        if not rig.problems:
            rig.mirrors.enable()
        if drift_seed is not None and rig.truth is not None:
            world = rig.truth.world
            before_s = float(np.random.default_rng(drift_seed).uniform(0.0, DRIFT_S))
            zero_s = world.scene_s(rig.clock.now_ns()) - before_s
            world.drift = ThermalMountDrift(seed=drift_seed, zero_s=zero_s)
        watch = SilentWatcher()
        return run_acceptance(
            environment_of_rig(rig, _shipped(config) if calibrated else None, access_of=OwnRig),
            begun_utc=utc_now().replace("Z", "+00:00"),
            watch=watch,
            options=options,
        )


def _shipped(config: SimulatedRigConfig) -> Calibration:
    return load_calibration(SHIPPED / f"sim-{config.preset}.json")


def _whole_run_s(report: Report) -> float:
    """Return how long a run of the product takes on the simulated rig, with all its frames."""
    report("a whole run")
    began_s = time.perf_counter()
    accepted({"scene": "calibration"}, calibrated=True, options=AcceptanceOptions())
    return round(time.perf_counter() - began_s, 1)
