"""Batches of crops for training steps; worker processes prepare them where a GPU would wait."""

import os
import signal
from collections.abc import Generator

import torch
from torch.utils.data import DataLoader, Dataset

from foveacam_pipeline.learn.losses import PairBatch
from foveacam_pipeline.learn.pairs import CropSource

LARGEST_WORKERS = 12
"""Largest default number of workers; each keeps up to 1 GiB of pairs in memory."""
AHEAD = 4
"""Number of batches that each worker prefetches."""


class _StepBatches(Dataset[PairBatch]):
    def __init__(self, crops: CropSource) -> None:
        self._crops = crops

    def __getitem__(self, step: int) -> PairBatch:
        return self._crops.batch(step)


def default_workers(device: torch.device) -> int:
    """Return the default number of workers: none for a CPU, because training uses all its cores."""
    if device.type == "cpu":
        return 0
    # macOS does not report the cores that a process may use
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
        multiprocessing_context="fork",  # workers share the pairs that are in memory already
    )
    yield from loader


def _ignore_interrupt(_worker: int) -> None:
    """Ignore Ctrl-C in a worker: the training handles it, and ends after the current step."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
