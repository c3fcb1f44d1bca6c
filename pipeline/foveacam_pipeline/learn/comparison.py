"""Training and evaluation of every row of Table 3 on pairs with truth: seeded, in processes, resumable.

The stereo networks are trained without truth, the monocular prior with it. Every run has its own folder, so
that a study that was stopped resumes where its runs ended.
"""

import hashlib
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import joblib
import numpy as np
import torch
from numpy.typing import NDArray

from foveacam_hardware.contract import Cancelled
from foveacam_pipeline.learn.checkpoint import load_checkpoint
from foveacam_pipeline.learn.device import one_thread
from foveacam_pipeline.learn.evaluation import (
    PairErrors,
    method_figures,
    network_answer,
    other_answers,
    pair_errors,
)
from foveacam_pipeline.learn.losses import LossWeights
from foveacam_pipeline.learn.monocular.prior import CheckpointPrior
from foveacam_pipeline.learn.monocular.prior_loss import PriorSchedule, aligned
from foveacam_pipeline.learn.monocular.training import PriorPlan, train_prior
from foveacam_pipeline.learn.network.network import FoveatedStereo
from foveacam_pipeline.learn.pair_folder import PairSample, PairTruth, StoredPairs
from foveacam_pipeline.learn.pairs import LoadedDataset, picture_planes, shifted_dataset, shifted_pair
from foveacam_pipeline.learn.training import CHECKPOINT, TrainingPlan, TrainingWatcher, train
from foveacam_pipeline.learn.truth_figures import MethodAnswer
from foveacam_pipeline.stereo.rectify import halved
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_pipeline.study.learned.outcomes import (
    FULL,
    SHIFT_PX,
    LearnedBudget,
    LearnedOutcome,
    Method,
    RowFigures,
    ShownPair,
)
from foveacam_pipeline.workers.progress import SILENT, ProgressSteps, ProgressWatcher

SHOWN = 3
"""Number of held-out pairs that are drawn."""
LARGEST_SPREAD_PX = 2.0
"""Four pixels whose disparities differ by more contain an edge; at half size their truth is not counted."""
POLL_S = 0.3
STOP = "stop"
ENDED = "the study was stopped; the same command goes on with the trainings where they ended"


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """How a network of a row is trained."""

    signed: bool = True
    shifted: bool = False
    geometry: bool = False
    prior: PriorSchedule = "annealed"


VARIANTS: Mapping[Method, Variant] = {
    Method.UNSIGNED: Variant(signed=False),
    Method.UNSIGNED_SHIFTED: Variant(signed=False, shifted=True),
    Method.NO_PRIOR: Variant(prior="none"),
    Method.FULL_PRIOR: Variant(prior="full"),
    Method.ANNEALED: Variant(),
    Method.GEOMETRY: Variant(geometry=True),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparisonPlan:
    """Folders of the training pairs, of the held-out pairs and of the runs."""

    train: Path
    held_out: Path
    runs: Path
    budget: LearnedBudget = FULL
    seed: int = 0
    trained: tuple[Method, ...] = tuple(VARIANTS)
    """Rows whose networks are trained."""

    @property
    def seeds(self) -> range:
        """The seeds of the runs."""
        return range(self.seed, self.seed + self.budget.seeds)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Judged:
    """Rows of one job, and the disparities of the pairs that are drawn."""

    figures: Mapping[Method, RowFigures]
    drawn_px: Mapping[Method, tuple[NDArray[np.float32], ...]]
    cpu_s: float


def compare(plan: ComparisonPlan, *, processes: int = 1, watch: ProgressWatcher = SILENT) -> LearnedOutcome:
    """Return the figures of every method; raise Cancelled when the watcher asks, InvalidInput for the pairs.

    `processes`: joblib's count, -1 for one a core. The figures do not depend on it.
    """
    first = [(_judge_prior, plan, seed, None) for seed in plan.seeds]
    others = [(_judge_network, plan, seed, method) for method in plan.trained for seed in plan.seeds]
    steps = ProgressSteps(watch, 1 + len(first) + len(others), ended=ENDED)
    rows: dict[Method, list[RowFigures]] = {}
    drawn: dict[Method, tuple[NDArray[np.float32], ...]] = {}
    cpu_s = 0.0
    plan.runs.mkdir(parents=True, exist_ok=True)
    for jobs in ([(_judge_others, plan, plan.seed, None)], first, others):
        for judged in _run_jobs(jobs, plan.runs / STOP, processes=processes, watch=watch):
            steps.step(", ".join(judged.figures))
            cpu_s += judged.cpu_s
            for method, figures in judged.figures.items():
                rows.setdefault(method, []).append(figures)
                drawn.setdefault(method, judged.drawn_px[method])
    samples = _load(plan.held_out, plan.budget.held_out).pairs[:SHOWN]
    shown = tuple(
        ShownPair(
            left=sample.pair.left,
            right=sample.pair.right,
            disparities_px={method: maps[number] for method, maps in drawn.items()},
        )
        for number, sample in enumerate(samples)
    )
    ordered = {method: tuple(rows[method]) for method in Method if method in rows}
    return LearnedOutcome(budget=plan.budget, rows=ordered, shown=shown, trained_cpu_s=cpu_s)


_Job = tuple[
    Callable[[ComparisonPlan, int, Method | None, Callable[[], bool]], _Judged],
    ComparisonPlan,
    int,
    Method | None,
]


def _run_jobs(
    jobs: Sequence[_Job], stop: Path, *, processes: int, watch: ProgressWatcher
) -> Iterator[_Judged]:
    """Yield the results of jobs in order; `stop`: a file that ends each within a step, once cancelled."""
    if processes == 1:
        for work, plan, seed, method in jobs:
            yield work(plan, seed, method, watch.cancelled)
        return
    with _stop_file(stop, watch.cancelled), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "A worker stopped")  # it grew, and joblib restarted it
        workers = joblib.Parallel(n_jobs=processes, return_as="generator")
        yield from workers(joblib.delayed(_run_job)(job, stop) for job in jobs)


def _run_job(job: _Job, stop: Path) -> _Judged:
    work, plan, seed, method = job
    return work(plan, seed, method, stop.exists)


@contextmanager
def _stop_file(path: Path, cancelled: Callable[[], bool]) -> Iterator[None]:
    """Create a file once the work is cancelled, which workers in other processes check."""
    path.unlink(missing_ok=True)
    over = threading.Event()

    def look() -> None:
        while not over.wait(POLL_S):
            if cancelled():
                path.touch()
                return

    looking = threading.Thread(target=look, name="stop of the trainings", daemon=True)
    looking.start()
    try:
        yield
    finally:
        over.set()
        looking.join()
        path.unlink(missing_ok=True)


def _judge_others(
    plan: ComparisonPlan, _seed: int, _method: Method | None, _stopped: Callable[[], bool]
) -> _Judged:
    """Evaluate the methods that are not trained."""
    names = {
        "zero": Method.ZERO,
        "truth": Method.TRUTH,
        "sgbm": Method.MATCHING,
        "sgbm, filled": Method.MATCHING_FILLED,
    }
    return _judge(
        plan, lambda sample: {names[name]: answer for name, answer in other_answers(sample).items()}
    )


def _judge_prior(
    plan: ComparisonPlan, seed: int, _method: Method | None, stopped: Callable[[], bool]
) -> _Judged:
    """Train the prior of a seed and evaluate it alone."""
    budget, folder = plan.budget, _prior_folder(plan, seed)
    folder.mkdir(exist_ok=True)
    prior_plan = PriorPlan(steps=budget.prior_steps, batch=budget.batch, crop_px=budget.crop_px, seed=seed)
    before_s = time.process_time()
    with one_thread():
        facts = train_prior([_load(plan.train, budget.pairs)], folder, prior_plan, _watcher(stopped))
    _check_complete(facts.steps, budget.prior_steps)
    prior = CheckpointPrior(folder / CHECKPOINT)
    judged = _judge(plan, lambda sample: _prior_answers(prior, sample))
    return replace(judged, cpu_s=time.process_time() - before_s)


def _judge_network(
    plan: ComparisonPlan, seed: int, method: Method | None, stopped: Callable[[], bool]
) -> _Judged:
    """Train a network of a row without truth, and evaluate it."""
    if method is None:
        raise ValueError("a network is trained for a row")
    variant, budget = VARIANTS[method], plan.budget
    folder = plan.runs / f"{method.name.lower()}-{seed}"
    folder.mkdir(exist_ok=True)
    training_plan = TrainingPlan(
        steps=budget.steps,
        batch=budget.batch,
        crop_px=budget.crop_px,
        seed=seed,
        weights=LossWeights(truth=0.0),
        signed=variant.signed,
        geometry=variant.geometry,
        prior=variant.prior,
    )
    prior = CheckpointPrior(_prior_folder(plan, seed) / CHECKPOINT)
    before_s = time.process_time()
    dataset = _without_truth(_load(plan.train, budget.pairs))
    dataset = shifted_dataset(dataset, SHIFT_PX) if variant.shifted else dataset
    with one_thread():
        facts = train([dataset], folder, training_plan, _watcher(stopped), prior=prior)
    _check_complete(facts.steps, budget.steps)
    network = load_checkpoint(folder / CHECKPOINT).network()
    judged = _judge(
        plan, lambda sample: {method: variant_answer(network, sample.pair, shifted=variant.shifted)}
    )
    return replace(judged, cpu_s=time.process_time() - before_s)


def variant_answer(network: FoveatedStereo, pair: RectifiedPair, *, shifted: bool) -> MethodAnswer:
    """Return the disparities of a pair by a network; `shifted`: its input is the shifted pair."""
    shift_px = SHIFT_PX if shifted else 0
    answer, _ = network_answer(network, shifted_pair(pair, shift_px))
    return replace(answer, disparity_px=answer.disparity_px - np.float32(shift_px))


def _prior_answers(prior: CheckpointPrior, sample: PairSample) -> dict[Method, MethodAnswer]:
    """Return the prior's disparities, aligned to matches that pass the left-right check, and to the truth."""
    if sample.truth is None:
        raise ValueError("a prior is judged by pairs with truth")
    matches = other_answers(sample)["sgbm"].disparity_px
    inverse_depth = prior.inverse_depth(torch.from_numpy(picture_planes(sample.pair.left))[None])
    targets = {
        Method.MONO: (matches, np.isfinite(matches)),
        Method.MONO_ORACLE: (sample.truth.disparity_px, sample.truth.both),
    }
    return {
        method: MethodAnswer(
            disparity_px=aligned(
                inverse_depth,
                torch.from_numpy(np.nan_to_num(target_px))[None, None],
                torch.from_numpy(known)[None, None],
            )[0, 0].numpy()
        )
        for method, (target_px, known) in targets.items()
    }


def _judge(plan: ComparisonPlan, answers: Callable[[PairSample], Mapping[Method, MethodAnswer]]) -> _Judged:
    errors: dict[Method, list[PairErrors]] = {}
    drawn: dict[Method, list[NDArray[np.float32]]] = {}
    with one_thread():
        for sample in _load(plan.held_out, plan.budget.held_out).pairs:
            if sample.truth is None:
                raise ValueError("methods are judged by pairs with truth")
            for method, answer in answers(sample).items():
                errors.setdefault(method, []).append(pair_errors(sample, answer, sample.truth.both))
                drawn.setdefault(method, []).append(answer.disparity_px)
    return _Judged(
        figures={method: _row(method, found) for method, found in errors.items()},
        drawn_px={method: tuple(maps[:SHOWN]) for method, maps in drawn.items()},
        cpu_s=0.0,
    )


def _row(method: Method, errors: Sequence[PairErrors]) -> RowFigures:
    found = method_figures(method, errors)
    if found.truth is None or found.truth.abs_rel is None:
        raise ValueError("no pixel of the held-out pairs has a truth")
    return RowFigures(
        photometric=found.photometric,
        photometric_seen=found.photometric_seen,
        absolute=found.absolute,
        epe_px=found.truth.epe_px,
        bad_1=found.truth.bad_1,
        abs_rel=found.truth.abs_rel,
        answered=found.truth.answered,
        within_1_sigma=found.truth.within_1_sigma,
    )


def _prior_folder(plan: ComparisonPlan, seed: int) -> Path:
    return plan.runs / f"prior-{seed}"


def _watcher(stopped: Callable[[], bool]) -> TrainingWatcher:
    return TrainingWatcher(on_step=lambda _done, _total, _loss: None, stopped=stopped)


def _check_complete(steps: int, planned: int) -> None:
    if steps < planned:
        raise Cancelled(ENDED)


def _load(folder: Path, count: int) -> LoadedDataset:
    """Return the first pairs of a folder at half the size; more may be added to it later."""
    stored = StoredPairs(folder)
    hashes = "".join(entry.sha256 for entry in stored.document.pairs[:count])
    return LoadedDataset(
        name=f"{folder.name}, halved",
        digest=hashlib.sha256(hashes.encode()).hexdigest(),
        pairs=tuple(halved_sample(sample) for sample in stored[:count]),
        labelled=True,
    )


def _without_truth(dataset: LoadedDataset) -> LoadedDataset:
    pairs = tuple(PairSample(pair=sample.pair) for sample in dataset.pairs)
    return replace(dataset, pairs=pairs, labelled=False)


def halved_sample(sample: PairSample) -> PairSample:
    """Return a sample at half the size; a pixel across an edge keeps its truth, but is not evaluated."""
    pair, truth = halved(sample.pair), sample.truth
    if truth is None:
        return PairSample(pair=pair)
    height, width = pair.left.shape[:2]

    def fours(values: NDArray[np.generic]) -> NDArray[np.generic]:
        even = values[: 2 * height, : 2 * width]
        return even.reshape(height, 2, width, 2).swapaxes(1, 2).reshape(height, width, 4)

    full_px = np.asarray(fours(truth.disparity_px), dtype=np.float32)
    flat = full_px.max(axis=2) - full_px.min(axis=2) <= LARGEST_SPREAD_PX
    disparity_px = np.where(flat, full_px.mean(axis=2), full_px[:, :, 0]) / np.float32(2.0)
    both = flat & np.asarray(fours(truth.both), dtype=np.bool_).all(axis=2)
    seen = np.isfinite(disparity_px)
    return PairSample(
        pair=pair,
        truth=PairTruth(disparity_px=disparity_px.astype(np.float32), both=both, occluded=seen & ~both),
    )
