"""Batches of crops for the steps of a training; worker processes make them ahead where a GPU would wait."""

import os
import signal
from collections.abc import Generator

import torch
from torch.utils.data import DataLoader, Dataset

from foveacam_pipeline.learn.losses import PairBatch
from foveacam_pipeline.learn.pairs import CropSource

LARGEST_WORKERS = 12
"""Of the default; each keeps up to 1 GiB of pairs in memory."""
AHEAD = 4
"""Batches that each worker makes before they are asked for."""


class _StepBatches(Dataset[PairBatch]):
    def __init__(self, crops: CropSource) -> None:
        self._crops = crops

    def __getitem__(self, step: int) -> PairBatch:
        return self._crops.batch(step)


def default_workers(device: torch.device) -> int:
    """Return how many processes make crops: none beside a processor that computes on all cores itself."""
    if device.type == "cpu":
        return 0
    # macOS does not tell the cores that a process may use
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(LARGEST_WORKERS, max(1, cores - 1))


def step_batches(
    crops: CropSource, steps: range, *, workers: int, device: torch.device
) -> Generator[PairBatch]:
    """Yield the crops of each step in order; they are the same for any number of workers."""
    if workers == 0:
        yield from (crops.batch(step) for step in steps)
        return
    loader: DataLoader[PairBatch] = DataLoader(
        _StepBatches(crops),
        batch_size=None,
        sampler=steps,
        num_workers=workers,
        prefetch_factor=AHEAD,
        pin_memory=device.type == "cuda",
        worker_init_fn=_ignore_interrupt,
        multiprocessing_context="fork",  # the pairs that are in memory already are shared with the workers
    )
    yield from loader


def _ignore_interrupt(_worker: int) -> None:
    """Leave Ctrl-C to the training, which ends after the step under way."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
