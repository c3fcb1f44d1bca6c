"""Compare policies by the time until the depth of a field is known, in virtual time, scene by scene.

Every policy gets the same number of looks. What counts as the field of a scene is what any of them has
measured to the goal by then: no policy measures blank walls and the sky. Times are those of the rig's clock,
without the time to compute. Nothing was tuned on the random scenes.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np
import tomlkit
from numpy.typing import NDArray

from foveacam_bench.attention.baselines import (
    BySalience,
    ByUncertainty,
    RandomLooks,
    Raster,
    spectral_residual,
)
from foveacam_bench.figures import Figures, Report
from foveacam_bench.verge.fixations import CERTIFICATE
from foveacam_hardware.contract import Binning
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.attention.field import FieldGrid
from foveacam_pipeline.attention.looks import Candidates
from foveacam_pipeline.attention.losses import GOAL
from foveacam_pipeline.attention.policy import AttentionPolicy, Policy
from foveacam_pipeline.attention.watching import FieldMemory, Watcher
from foveacam_pipeline.learn.pair_folder import Split
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.wide_depth.wide_context import WideContext
from foveacam_server.resources.studying.learning.random_scenes import draw_scene, scene_seed
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

SCENES = ("bench", "street", "toy")
RANDOM, QUICK_RANDOM = 20, 1
LOOKS, QUICK_LOOKS = 100, 60
SEED = 1_311
WANTED = 0.9
"""Share of what any policy has measured at which a field counts as known."""
POLICY = "policy"
OTHERS = ("raster", "random", "saliency", "uncertainty")
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """One policy in one scene: the time of each look, s, and which cells were known to the goal after it."""

    times_s: list[float]
    known: list[Bools]
    decided_ms: list[float]

    def time_until_s(self, field: Bools) -> float:
        """Return the time until `WANTED` of a field is known, or that of the last look."""
        for time_s, known in zip(self.times_s, self.known, strict=True):
            if (known & field).sum() >= WANTED * field.sum():
                return time_s
        return self.times_s[-1]

    def share(self, field: Bools) -> float:
        """Return the share of a field that was known at the end."""
        return float((self.known[-1] & field).sum() / max(1, field.sum()))


def run(
    *, quick: bool = False, binning: Binning = 2, seed: int = SEED, report: Report | None = None
) -> Figures:
    """Return the figures; `seed`: of the random scenes."""
    calibration = load_calibration(CERTIFICATE)
    scenes = list(_scenes(seed, quick=quick))
    looks = QUICK_LOOKS if quick else LOOKS
    named: dict[str, dict[str, Course]] = {}
    with TemporaryDirectory() as folder:
        for number, (name, content) in enumerate(scenes, start=1):
            named[name] = {}
            for policy in (POLICY, *OTHERS):
                if report is not None:
                    report(f"scene {number} of {len(scenes)}, {policy}")
                scene = _written(Path(folder) / f"{name}.toml", content) if content else name
                named[name][policy] = course(scene, policy, calibration, looks=looks, binning=binning)
    return figures(named)


def figures(named: dict[str, dict[str, Course]]) -> Figures:
    """Return the figures of courses by scene and policy."""
    times: dict[str, list[float]] = {policy: [] for policy in (POLICY, *OTHERS)}
    shares: dict[str, list[float]] = {policy: [] for policy in (POLICY, *OTHERS)}
    for courses in named.values():
        field = np.any([one.known[-1] for one in courses.values()], axis=0)
        for policy, one in courses.items():
            times[policy].append(one.time_until_s(field))
            shares[policy].append(one.share(field))
    decided = [ms for courses in named.values() for ms in courses[POLICY].decided_ms]
    found: Figures = {
        "map_time_ratio": sum(times[POLICY]) / sum(times["raster"]),
        "map_time_ratio_uncertainty": sum(times[POLICY]) / sum(times["uncertainty"]),
        "map_time_ratio_random": sum(times[POLICY]) / sum(times["random"]),
        "map_time_ratio_saliency": sum(times[POLICY]) / sum(times["saliency"]),
        "policy_ms": median(decided),
        "policy_p95_ms": float(np.quantile(decided, 0.95)),
        "scenes": len(named),
    }
    for policy in (POLICY, *OTHERS):
        found[f"map_s_{policy}"] = median(times[policy])
        found[f"known_fraction_{policy}"] = float(np.mean(shares[policy]))
    return found


def course(scene: str, policy: str, calibration: Calibration, *, looks: int, binning: Binning) -> Course:
    """Watch one scene with one policy for a number of looks, or until it finds nothing to look at."""
    with _rig(scene, binning) as rig:
        context = WideContext(calibration.wide, now_s=lambda: rig.clock.now_ns() / 1e9)
        grid = FieldGrid.of(calibration.wide, context_cell_px=context.cell_px)
        candidates = Candidates(calibration, grid, binning=binning)
        watcher = Watcher(rig.head, calibration, context, FieldMemory(grid), candidates, clock=rig.clock)
        wide = gray(to_uint8(rig.wide.latest(max_age_ms=500.0)))
        chooser = chooser_of(policy, candidates, wide)
        began_ns = rig.clock.now_ns()
        found = Course(times_s=[], known=[], decided_ms=[])
        for _ in range(looks):
            made = watcher.look(chooser, wide)
            if made is None:
                break
            found.times_s.append((rig.clock.now_ns() - began_ns) / 1e9)
            found.known.append(_known(context))
            found.decided_ms.append(made.decided_ms)
            wide = gray(to_uint8(made.sighting.wide))
            context.detect_changes(wide)
        return found


def chooser_of(policy: str, candidates: Candidates, wide: NDArray[np.uint8]) -> Policy:
    """Return a policy by its name; `wide`: (h, w) uint8 the wide picture at the start."""
    grid = candidates.grid
    made: dict[str, Callable[[], Policy]] = {
        POLICY: lambda: AttentionPolicy(candidates),
        "raster": lambda: Raster(candidates),
        "random": lambda: RandomLooks(candidates, np.random.default_rng(SEED)),
        "saliency": lambda: BySalience(candidates, spectral_residual(wide, (grid.rows, grid.columns))),
        "uncertainty": lambda: ByUncertainty(candidates),
    }
    return made[policy]()


@contextmanager
def _rig(scene: str, binning: Binning) -> Iterator[Rig]:
    with open_simulated(scene=scene, inline=True) as rig:
        bin_cameras(rig, binning)
        yield rig


def _scenes(seed: int, *, quick: bool) -> Iterator[tuple[str, str]]:
    """Yield names of scenes, and the files' content of those that are not shipped."""
    for name in SCENES[: 1 if quick else None]:
        yield name, ""
    for index in range(QUICK_RANDOM if quick else RANDOM):
        drawn = draw_scene(scene_seed(seed, Split.HELD_OUT, index)).file
        yield f"random-{index}", tomlkit.dumps(drawn.model_dump(mode="json", exclude_none=True))


def _written(path: Path, content: str) -> str:
    path.write_text(content, encoding="utf-8")
    return str(path)


def _known(context: WideContext) -> Bools:
    """Return (rows, columns) bool: the cells that are known to the goal."""
    known = context.snapshot()
    with np.errstate(invalid="ignore"):
        relative = known.sigma_per_m[0] / known.inverse_z_per_m[0]
    return np.asarray(known.known[0] & (relative <= GOAL), dtype=np.bool_)
