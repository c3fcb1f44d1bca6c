"""Recipes of the studies: settings, the files on which a result depends, and the computing function."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import foveacam_hardware
import foveacam_pipeline
from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.report.cache import cache_key, source_files
from foveacam_pipeline.study.report.findings import StudyResult
from foveacam_pipeline.workers.progress import ProgressWatcher
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

CERTIFICATE = SHIPPED / "sim-rig120.json"
LIBRARIES = ("numpy", "scipy", "shapely", "opencv-python-headless", "matplotlib", "torch")
PAIR_SOURCES = tuple(
    Path(__file__).parents[1] / "learning" / f"{name}.py"
    for name in ("random_scenes", "rendered_looks", "rendered_pairs")
)
"""Sources on which simulated pairs depend, besides the renderer."""
CLICKS, QUICK_CLICKS = 30, 8
"""Number of fixations whose true residuals measure the rig's error of matching."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyOrder:
    """The options of the command; None: the study's own default."""

    quick: bool = False
    jobs: int | None = None
    cluster: str | None = None
    maps: int | None = None
    seed: int | None = None
    vkitti: Path | None = None
    matching_errors: tuple[str, ...] = ()

    @property
    def seeded(self) -> dict[str, int]:
        """The seed as a keyword argument, if one was given."""
        return {} if self.seed is None else {"seed": self.seed}


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyRecipe:
    """Recipe of one study.

    `settings` (with library versions) and `files` are all on which its result depends.
    """

    name: str
    settings: Mapping[str, object]
    files: tuple[Path, ...]
    compute: Callable[[ProgressWatcher], StudyResult]


def recipes(order: StudyOrder, names: Sequence[str]) -> list[StudyRecipe]:
    """Return the recipes of the named studies. Raise InvalidInput for an option that none of them uses."""
    if order.vkitti is not None and "tradeoff" not in names:
        raise InvalidInput(f"--vkitti {order.vkitti}: only the study tradeoff uses it; leave it out")
    if (order.cluster is not None or order.maps is not None) and "standoff" not in names:
        raise InvalidInput("--cluster and --maps are for the study standoff; leave them out")
    if order.matching_errors and "depth" not in names:
        raise InvalidInput("--matching-error is for the study depth; leave it out")
    if order.jobs == 0:
        raise InvalidInput("--jobs 0: no process is too few; give 1 or more, or -1 for one a core")
    return [_KNOWN[name](order) for name in names]


def cache_folder() -> Path:
    """Return the folder of cached results (XDG base directories)."""
    root = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(root) / "foveacam" / "studies"


def versions() -> dict[str, str]:
    """Return the versions of the program and of the libraries; "not installed" for a missing one."""
    return {name: _version(name) for name in ("foveacam-duo", *LIBRARIES)}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _recipe(
    name: str,
    order: StudyOrder,
    compute: Callable[[ProgressWatcher], StudyResult],
    *,
    rig: bool = False,
    pairs: bool = False,
    **settings: object,
) -> StudyRecipe:
    """Return a recipe with the files on which its result depends, and its `settings` as plain JSON values.

    `rig`: it uses the simulated rig, and depends on its sources and scenes. `pairs`: it uses simulated pairs,
    and depends on their sources.
    """
    files = source_files(Path(foveacam_pipeline.__file__).parent)
    if rig:
        hardware = Path(foveacam_hardware.__file__).parent
        files += (
            *source_files(hardware),
            *sorted(hardware.rglob("*.toml")),
            *source_files(Path(__file__).parent),
        )
        files += (CERTIFICATE,)
    if pairs:
        files += PAIR_SOURCES
    settings |= {"quick": order.quick, "libraries": versions()}
    return StudyRecipe(name=name, settings=settings, files=files, compute=compute)


def _prepare(watch: ProgressWatcher) -> None:
    """Compile the renderer of the simulated rig, which takes a minute the first time."""
    from foveacam_hardware.sim.render import warm_up

    warm_up(lambda done, total, _: watch.progress(done, total=total, note="preparing the simulated rig"))


def _depth(order: StudyOrder) -> StudyRecipe:
    from foveacam_pipeline.study.tradeoff.depth_error import check_distinct
    from foveacam_server.resources.studying.studies.matching_errors import VERGE, parse_matching_error

    given = check_distinct([error for text in order.matching_errors for error in parse_matching_error(text)])

    def compute(watch: ProgressWatcher) -> StudyResult:
        from foveacam_pipeline.study.tradeoff.depth_error import depth_error_study

        if any(error.key == VERGE for error in given):
            return depth_error_study(given)
        from foveacam_server.resources.studying.studies.truth_measurements import verge_error

        _prepare(watch)
        measured = verge_error(QUICK_CLICKS if order.quick else CLICKS, watch=watch)
        return depth_error_study((measured, *given))

    errors = [asdict(error) for error in given]
    return _recipe("depth", order, compute, rig=True, matching_errors=errors)


def _tradeoff(order: StudyOrder) -> StudyRecipe:
    def compute(watch: ProgressWatcher) -> StudyResult:
        from foveacam_pipeline.study.tradeoff.study import tradeoff_study
        from foveacam_pipeline.study.tradeoff.vkitti import vkitti_frames
        from foveacam_server.resources.studying.studies.truth_measurements import rig_pair

        if order.vkitti is not None:
            vkitti_frames(order.vkitti, count=1)  # what is missing is reported before the rig is used
        _prepare(watch)
        return tradeoff_study(
            quick=order.quick,
            vkitti=order.vkitti,
            rig_pairs=(rig_pair(quick=order.quick, watch=watch),),
            seed=order.seed or 0,
            watch=watch,
        )

    vkitti = _state_of(order.vkitti)
    return _recipe("tradeoff", order, compute, rig=True, vkitti=vkitti, seed=order.seed)


def _state_of(folder: Path | None) -> str | None:
    """Return a folder's path with its modification time, so that a change gives another key."""
    if folder is None:
        return None
    changed_ns = folder.stat().st_mtime_ns if folder.exists() else 0
    return f"{folder.resolve()} {changed_ns}"


def _tokens(order: StudyOrder) -> StudyRecipe:
    def compute(watch: ProgressWatcher) -> StudyResult:
        from foveacam_pipeline.learn import attention
        from foveacam_pipeline.study.tokens.study import tokens_study

        timing = attention.QUICK if order.quick else attention.FULL
        try:
            measured = attention.measure(timing, watch=watch)
        except InvalidInput as error:  # torch is an extra; the model is reported without it
            return tokens_study(quick=order.quick, not_measured=str(error))
        return tokens_study(quick=order.quick, measured=measured)

    return _recipe("tokens", order, compute)


def _standoff(order: StudyOrder) -> StudyRecipe:
    def compute(watch: ProgressWatcher) -> StudyResult:
        from foveacam_pipeline.study.visibility.study import standoff_study

        given = order.seeded | ({} if order.maps is None else {"maps": order.maps})
        return standoff_study(
            quick=order.quick, n_jobs=order.jobs or 1, cluster=order.cluster, watch=watch, **given
        )

    return _recipe("standoff", order, compute, maps=order.maps, seed=order.seed)


def _fig8(order: StudyOrder) -> StudyRecipe:
    def compute(watch: ProgressWatcher) -> StudyResult:
        from foveacam_pipeline.study.visibility.observed_study import observed_study
        from foveacam_server.resources.studying.studies.simulated_rigs import placed_rig

        _prepare(watch)
        with placed_rig() as observer:
            return observed_study(observer, quick=order.quick, watch=watch)

    return _recipe("fig8", order, compute, rig=True)


def _localisation(order: StudyOrder) -> StudyRecipe:
    def compute(watch: ProgressWatcher) -> StudyResult:
        from foveacam_pipeline.study.localisation.study import localisation_study
        from foveacam_server.resources.studying.studies.simulated_rigs import rail_rig

        _prepare(watch)
        with rail_rig() as rig:
            return localisation_study(rig, quick=order.quick, watch=watch, **order.seeded)

    return _recipe("localisation", order, compute, rig=True, seed=order.seed)


def _learned(order: StudyOrder) -> StudyRecipe:
    def compute(watch: ProgressWatcher) -> StudyResult:
        from foveacam_server.resources.studying.studies.trained_networks import TrainedStudy, compute_learned

        recipe = _learned(order)
        wanted = TrainedStudy(
            quick=order.quick,
            processes=order.jobs or -1,
            seed=order.seed or 0,
            cache=cache_folder(),
            key=cache_key(recipe.name, recipe.settings, files=recipe.files),
        )
        return compute_learned(wanted, watch)

    return _recipe("learned", order, compute, rig=True, pairs=True, seed=order.seed)


_KNOWN: dict[str, Callable[[StudyOrder], StudyRecipe]] = {
    "depth": _depth,
    "localisation": _localisation,
    "tradeoff": _tradeoff,
    "tokens": _tokens,
    "standoff": _standoff,
    "fig8": _fig8,
    "learned": _learned,
}
