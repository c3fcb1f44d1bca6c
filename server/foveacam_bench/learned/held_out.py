"""Held-out pairs for benches: a folder that was given, or one that is rendered once and kept.

The folder is named by what its pairs depend on, so that changed scenes get pairs of their own.
"""

import hashlib
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.pair_folder import PairSample, Split, StoredPairs
from foveacam_pipeline.workers.processes import local_workers
from foveacam_server.resources.studying.learning import random_scenes, rendered_looks
from foveacam_server.resources.studying.learning.rendered_pairs import PairOrder, make_pairs, pair_plan

SEED = 5
PAIRS, QUICK_PAIRS = 200, 8
SIZE = (360, 270)
WORKERS = len(os.sched_getaffinity(0))


def held_out_pairs(folder: Path | None, *, count: int) -> Sequence[PairSample]:
    """Return at most `count` pairs of a folder; without a folder, they are rendered if missing.

    Raise InvalidInput for a folder of training pairs.
    """
    if folder is None:
        return _rendered(count)
    stored = StoredPairs(folder)
    if stored.document.split is not Split.HELD_OUT:
        raise InvalidInput(
            f"{folder} holds pairs to train on",
            asked=str(folder),
            found=stored.document.split,
            remedy="make others with `foveacam learn pairs --split held-out`",
        )
    return stored[:count]


def _rendered(count: int) -> Sequence[PairSample]:
    order = PairOrder(
        folder=Path(),
        count=count,
        seed=SEED,
        split=Split.HELD_OUT,
        size=SIZE,
    )
    order = replace(order, folder=_cache_folder(order))
    with local_workers(WORKERS) as pool:
        make_pairs(order, pool, on_pair=lambda *_: None, stopped=lambda: False)
    return StoredPairs(order.folder)[:count]


def _cache_folder(order: PairOrder) -> Path:
    """Return the folder of these pairs, named by the hash of their plan and of the code that renders them."""
    digest = hashlib.sha256(pair_plan(order).model_dump_json().encode())
    for module in (random_scenes, rendered_looks):
        digest.update(Path(str(module.__file__)).read_bytes())
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "foveacam" / "pairs" / digest.hexdigest()[:16]
