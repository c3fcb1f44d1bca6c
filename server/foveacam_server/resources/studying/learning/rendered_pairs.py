"""Makes and resumes folders of pairs with truth for `foveacam learn pairs`, on any workers.

A pair depends only on seed, split, size and its index, on any machine.
"""

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.learn.pair_folder import (
    PairDocument,
    PairEntry,
    PairFolderWriter,
    Split,
    arrays_sha256,
    pair_arrays,
)
from foveacam_pipeline.workers.pool import WorkersLost, WorkPool, results_in_order
from foveacam_server.resources.studying.learning.random_scenes import draw_scene, scene_seed
from foveacam_server.resources.studying.learning.rendered_looks import (
    PRESET,
    own_calibration,
    render_look,
    scale_of,
)

MadePair: TypeAlias = tuple[PairEntry, dict[str, NDArray[np.generic]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class PairOrder:
    """The pairs to make; `size`: width and height, px."""

    folder: Path
    count: int
    seed: int
    split: Split
    size: tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class MadePairs:
    """The folder's document, the number of pairs that this call made, and its rate per second."""

    document: PairDocument
    made: int
    pairs_per_s: float


def make_pairs(
    order: PairOrder,
    pool: WorkPool,
    *,
    on_pair: Callable[[int, int, float], None],
    stopped: Callable[[], bool],
) -> MadePairs:
    """Make the missing pairs of a folder; when stopped, the finished ones are kept.

    `on_pair` gets the pairs done, their total, and the rate, pairs/s. Raise InvalidInput for a folder of
    other pairs, StorageFull for a full disk, WorkersLost.
    """
    writer = PairFolderWriter(order.folder, pair_plan(order))
    began, began_s = writer.count, time.perf_counter()
    on_pair(began, order.count, 0.0)
    rate = 0.0
    todo = ((order.seed, order.split, index, order.size) for index in range(began, order.count))
    try:
        with closing(results_in_order(pool, make_pair, todo)) as pairs:
            for entry, arrays in pairs:
                writer.add(entry, arrays)
                rate = (writer.count - began) / (time.perf_counter() - began_s)
                on_pair(writer.count, order.count, rate)
                if stopped():
                    break
    except WorkersLost as error:
        kept = len(writer.flush().pairs)
        raise WorkersLost(f"{error.statement}; {kept} pairs are kept", remedy=error.remedy) from error
    return MadePairs(document=writer.flush(), made=writer.count - began, pairs_per_s=rate)


def make_pair(seed: int, split: Split, index: int, size: tuple[int, int]) -> MadePair:
    """Return one pair and its entry."""
    calibration = own_calibration()
    number = scene_seed(seed, split, index)
    scale = scale_of(calibration, size)
    look = render_look(draw_scene(number), calibration, scale=scale, noise_seed=number)
    pair, arrays = look.pair, pair_arrays(look.pair, look.truth)
    entry = PairEntry(
        scene_seed=number,
        sha256=arrays_sha256(arrays),
        verged_z_m=pair.verged_z_m,
        u0_left_px=pair.u0_left_px,
        u0_right_px=pair.u0_right_px,
        v0_px=pair.v0_px,
        pose_sigma_px=pair.pose_sigma_px,
        row_error_px=look.row_error_px,
    )
    return entry, arrays


def pair_plan(order: PairOrder) -> PairDocument:
    """Return the document of a folder without its pairs."""
    calibration = own_calibration()
    scale = scale_of(calibration, order.size)
    return PairDocument(
        seed=order.seed,
        split=order.split,
        rig_preset=PRESET.name,
        calibration_id=calibration.id,
        width=order.size[0],
        height=order.size[1],
        scale=scale,
        f_px=calibration.fovea_f_px * scale,
        baseline_m=calibration.baseline_m,
    )
