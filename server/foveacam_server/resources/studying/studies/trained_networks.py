"""Computes the study of Sec. 5: renders pairs with truth once, trains networks, evaluates them.

Both are kept in the cache folder: the pairs for every later study, the trainings until the study is complete.
"""

import shutil
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import foveacam_hardware
from foveacam_hardware.contract import Cancelled, InvalidInput, install_command
from foveacam_pipeline.learn.pair_folder import Split
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_pipeline.study.learned.outcomes import FULL, QUICK
from foveacam_pipeline.study.learned.study import learned_study
from foveacam_pipeline.study.report.cache import cache_key, source_files
from foveacam_pipeline.study.report.findings import StudyResult
from foveacam_pipeline.workers.processes import local_workers
from foveacam_pipeline.workers.progress import ProgressWatcher
from foveacam_server.resources.studying.learning.rendered_pairs import PairOrder, make_pairs
from foveacam_server.resources.studying.studies.recipes import PAIR_SOURCES

PAIR_SEED = 1
PAIR_SIZE = (360, 270)
PAIR_WORKERS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainedStudy:
    """Settings of the study; `key`: hash of everything on which the trainings depend."""

    quick: bool
    processes: int
    seed: int
    cache: Path
    key: str


def compute_learned(wanted: TrainedStudy, watch: ProgressWatcher) -> StudyResult:
    """Return the study; raise InvalidInput without torch."""
    _check_torch()
    from foveacam_pipeline.learn.comparison import ComparisonPlan, compare

    budget = QUICK if wanted.quick else FULL
    runs = wanted.cache / f"learned-{wanted.key}"
    plan = ComparisonPlan(
        train=rendered_pairs(wanted.cache, Split.TRAIN, budget.pairs, watch),
        held_out=rendered_pairs(wanted.cache, Split.HELD_OUT, budget.held_out, watch),
        runs=runs,
        budget=budget,
        seed=wanted.seed,
    )
    with disk_errors("the trainings of a study", wanted.cache):
        outcome = compare(plan, processes=wanted.processes, watch=watch)
        shutil.rmtree(runs)
    return learned_study(outcome, seed=wanted.seed, quick=wanted.quick)


def rendered_pairs(cache: Path, split: Split, count: int, watch: ProgressWatcher) -> Path:
    """Return the folder of at least so many pairs, after rendering missing ones. Raise Cancelled."""
    folder = cache / f"pairs-{split.value}-{_pairs_key()}"
    order = PairOrder(folder=folder, count=count, seed=PAIR_SEED, split=split, size=PAIR_SIZE)
    with local_workers(PAIR_WORKERS) as pool:
        made = make_pairs(
            order,
            pool,
            on_pair=lambda done, total, _rate: watch.progress(done, total=total, note=f"{split.value} pairs"),
            stopped=watch.cancelled,
        )
    if len(made.document.pairs) < count:
        raise Cancelled("the study was stopped; the same command goes on with its pairs")
    return folder


def _pairs_key() -> str:
    """Return the hash of everything on which the pairs depend."""
    files = source_files(Path(foveacam_hardware.__file__).parent) + PAIR_SOURCES
    return cache_key("pairs", {"seed": PAIR_SEED, "size": list(PAIR_SIZE)}, files=files)


def _check_torch() -> None:
    if find_spec("torch") is None or find_spec("safetensors") is None:
        raise InvalidInput(
            "the study learned trains networks with torch, which is not installed",
            remedy=install_command("learn"),
        )
