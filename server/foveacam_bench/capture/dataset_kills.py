"""Kill a dataset's writer at seeded random moments (SIGKILL), and check the dataset on the disk afterwards.

The pictures are noise. `kill_figures` starts a process without threads, which forks a writer for every kill.
Each dataset is killed twice, the second time while it is being resumed.
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
    """Number of kills, and size of the dataset: `points` of three frames each, (height, width) px."""

    kills: int
    seed: int = 1
    points: int = 6
    height: int = 24
    width: int = 32


@dataclass(slots=True, kw_only=True)
class KillFigures:
    """Counts. `lost`: acknowledged points that are missing; `damaged`: files with a wrong hash.

    `unequal`: datasets whose index after resuming to the end differs from that of an uninterrupted run;
    `findings`: findings of `check` in those. `midway`: kills during the writing of a point.
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
    command = [sys.executable, "-m", __name__, str(folder), json.dumps(asdict(plan))]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - this module
    if ended.returncode != 0:
        raise FoveaError(f"the kills in {folder} ended early: {ended.stderr.strip()[-500:]}; run them again")
    figures: dict[str, int] = json.loads(ended.stdout)
    return figures


def kill_trials(folder: Path, plan: KillPlan) -> KillFigures:
    """Kill and resume until the plan's kills are done. Forks: only for a process without threads."""
    figures, rng = KillFigures(), np.random.default_rng(plan.seed)
    write(folder / "undisturbed", plan, pipe=None)
    expected = (folder / "undisturbed" / INDEX).read_bytes()
    target = folder / "killed"
    while figures.kills < plan.kills:
        shutil.rmtree(target, ignore_errors=True)
        acknowledged: set[int] = set()
        for _ in range(KILLS_A_DATASET):
            figures.kills += _kill_writer(target, plan, rng, acknowledged)
            _inspect(target, acknowledged, figures)
        write(target, plan, pipe=None)
        figures.unequal += (target / INDEX).read_bytes() != expected
        figures.findings += len(check_dataset(target))
    return figures


def write(folder: Path, plan: KillPlan, *, pipe: int | None) -> None:
    """Create or resume the dataset and write it to its end; report each stored point to `pipe`."""

    def on_stored(index: int) -> None:
        if pipe is not None:
            os.write(pipe, bytes([index]))

    settings = WriterSettings(on_acknowledged=on_stored)
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
    """Return a point with noise pictures, equal at every call."""
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


def _kill_writer(folder: Path, plan: KillPlan, rng: np.random.Generator, acknowledged: set[int]) -> bool:
    """Start a writer, kill it at a random moment, add the points it acknowledged; return whether it ran."""
    points_before = int(rng.integers(0, plan.points))
    patience_s = float(rng.uniform(0.0, 0.02))
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read_end)
        try:
            write(folder, plan, pipe=write_end)
        finally:
            os._exit(0)
    os.close(write_end)
    stored = [index for _ in range(points_before) for index in os.read(read_end, 1)]
    deadline_s = time.monotonic() + patience_s
    while time.monotonic() < deadline_s:
        pass
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    while rest := os.read(read_end, 256):
        stored.extend(rest)
    os.close(read_end)
    acknowledged.update(stored)
    return os.WIFSIGNALED(status)


def _inspect(folder: Path, acknowledged: set[int], figures: KillFigures) -> None:
    """Check the dataset after a kill, before it is repaired."""
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
