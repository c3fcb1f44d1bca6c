"""SIGKILL at seeded random moments while a dataset is written, and a check of what is on the disk afterwards.

A stub camera gives noise. The loop runs in a process of its own, without threads, and forks a writer for
every kill: `kill_figures` starts it. One dataset is killed twice, the second time while it is being resumed.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from foveacam_hardware.contract import FoveaError, Frame, MirrorVolts, Role
from foveacam_pipeline.capture.dataset import (
    CapturedPoint,
    DatasetHeader,
    DatasetWriter,
    PlanPosition,
    Shot,
    WriterSettings,
    check_dataset,
)
from foveacam_pipeline.capture.dataset.checking import sha256_of
from foveacam_pipeline.capture.dataset.document import DOCUMENT, read_document
from foveacam_pipeline.capture.dataset.index import INDEX
from foveacam_pipeline.capture.dataset.journal import read_journal
from foveacam_pipeline.capture.dataset.point_store import IMAGES

KILLS_A_DATASET = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class KillPlan:
    """How often to kill, and what is written: `points` of three frames each, (height, width) px."""

    kills: int
    seed: int = 1
    points: int = 6
    height: int = 24
    width: int = 32


@dataclass(slots=True, kw_only=True)
class KillFigures:
    """What was found. `lost`: acknowledged points that are gone; `damaged`: files with a wrong hash.

    `unequal`: datasets whose index, when they were resumed to the end, is not an undisturbed run's;
    `findings`: what `check` still says of those. `midway`: kills that found a point half written.
    """

    kills: int = 0
    lost: int = 0
    damaged: int = 0
    duplicates: int = 0
    unequal: int = 0
    findings: int = 0
    midway: int = 0


def kill_figures(folder: Path, plan: KillPlan) -> dict[str, int]:
    """Run all kills in a process of its own, in an empty `folder`; return the figures."""
    words = [sys.executable, "-m", __name__, str(folder), json.dumps(asdict(plan))]
    done = subprocess.run(words, capture_output=True, text=True, check=False)  # noqa: S603 - this very module
    if done.returncode != 0:
        raise FoveaError(f"the kills in {folder} ended early: {done.stderr.strip()[-500:]}; run them again")
    figures: dict[str, int] = json.loads(done.stdout)
    return figures


def kill_trials(folder: Path, plan: KillPlan) -> KillFigures:
    """Kill and resume until the plan's kills are done. Forks: only for a process without threads."""
    figures, rng = KillFigures(), np.random.default_rng(plan.seed)
    write(folder / "undisturbed", plan, pipe=None)
    wanted = (folder / "undisturbed" / INDEX).read_bytes()
    target = folder / "killed"
    while figures.kills < plan.kills:
        shutil.rmtree(target, ignore_errors=True)
        acknowledged: set[int] = set()
        for _ in range(KILLS_A_DATASET):
            figures.kills += _killed(target, plan, rng, acknowledged)
            _inspect(target, acknowledged, figures)
        write(target, plan, pipe=None)
        figures.unequal += (target / INDEX).read_bytes() != wanted
        figures.findings += len(check_dataset(target))
    return figures


def write(folder: Path, plan: KillPlan, *, pipe: int | None) -> None:
    """Begin or resume the dataset and write it to its end; write each stored point to `pipe`."""

    def kept(index: int) -> None:
        if pipe is not None:
            os.write(pipe, bytes([index]))

    settings = WriterSettings(on_acknowledged=kept)
    if (folder / DOCUMENT).exists():
        if read_document(folder).state == "complete":
            return
        writer = DatasetWriter.resume(folder, settings)
    else:
        header = DatasetHeader(points=plan.points, id="stub", created_utc="2026-01-01T00:00:00+00:00")
        writer = DatasetWriter.create(folder, header, settings)
    with writer:
        for index in range(writer.next_point, plan.points):
            writer.add(stub_point(index, plan))
        writer.finish()


def stub_point(index: int, plan: KillPlan) -> CapturedPoint:
    """Return the noise of a point, the same at every call."""
    rng = np.random.default_rng((plan.seed, index))
    shots = []
    for seq, role in enumerate(Role):
        frame = Frame(
            image=rng.integers(0, 256, (plan.height, plan.width), dtype=np.uint8),
            role=role,
            seq=index * 3 + seq,
            t_ns=index * 1_000_000,
            exposure_ns=5_000_000,
            volts=None if role is Role.WIDE else MirrorVolts(x_v=float(index), y_v=0.5),
        )
        shots.append(Shot(frame=frame))
    return CapturedPoint(place=PlanPosition(index=index, column=index, row=0), shots=tuple(shots))


def _killed(folder: Path, plan: KillPlan, rng: np.random.Generator, acknowledged: set[int]) -> bool:
    """Start a writer, kill it at a random moment; note what it acknowledged; return whether it was alive."""
    points_before = int(rng.integers(0, plan.points))
    patience_s = float(rng.uniform(0.0, 0.02))
    ours, theirs = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(ours)
        try:
            write(folder, plan, pipe=theirs)
        finally:
            os._exit(0)
    os.close(theirs)
    heard = [kept for _ in range(points_before) for kept in os.read(ours, 1)]
    deadline_s = time.monotonic() + patience_s
    while time.monotonic() < deadline_s:
        pass
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    while rest := os.read(ours, 256):
        heard.extend(rest)
    os.close(ours)
    acknowledged.update(heard)
    return os.WIFSIGNALED(status)


def _inspect(folder: Path, acknowledged: set[int], figures: KillFigures) -> None:
    """Check what a kill left, before anything is repaired."""
    if not (folder / DOCUMENT).exists():
        figures.lost += len(acknowledged)
        return
    journal = read_journal(folder, dataset_id="stub")
    found = [record.place.index for record in journal.records]
    files = [frame for record in journal.records for frame in record.frames]
    figures.lost += len(acknowledged - set(found))
    figures.duplicates += len(found) - len(set(found)) + len(files) - len({frame.file for frame in files})
    for frame in files:
        path = folder / frame.file
        figures.damaged += not path.is_file() or sha256_of(path) != frame.sha256
    images = folder / IMAGES
    figures.midway += images.is_dir() and len(list(images.iterdir())) > len(files)


if __name__ == "__main__":
    print(json.dumps(asdict(kill_trials(Path(sys.argv[1]), KillPlan(**json.loads(sys.argv[2]))))))  # noqa: T201
