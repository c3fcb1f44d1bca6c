"""Interrupts uploads at random points, by SIGKILL or by dropping connections; checks what is stored."""

import hashlib
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from foveacam_bench.archive.storage_proxy import StorageProxy, storage_proxy
from foveacam_bench.archive.storage_server import BUCKET, StorageServer
from foveacam_bench.figures import Figures
from foveacam_hardware.contract import DeviceFault
from foveacam_pipeline.capture.dataset.lock import LOCK
from foveacam_pipeline.storage.archive import RECORD, fetch_item, find_item, open_store
from foveacam_pipeline.storage.archive.large_files import PART_BYTES
from foveacam_pipeline.storage.archive.store import ENDPOINT

CUTS_AN_UPLOAD = 5
LARGE_PART_BYTES = 1 << 19
LARGE_PARTS = 64
"""Number of parts of the large file; small ones keep the bench short."""


@dataclass(slots=True, kw_only=True)
class CutFigures:
    """Counts.

    `lost`: files that were there before a cut and are not after it, or are not in the end. `damaged`: objects
    whose content does not match their key.
    """

    cuts: int = 0
    kills: int = 0
    lost: int = 0
    damaged: int = 0


def cut_figures(
    server: StorageServer, folder: Path, *, kills: int, drops: int, seed: int = 1
) -> dict[str, int]:
    """Cut uploads of the dataset in `folder`, complete each after five cuts, and return the counts."""
    figures, rng = CutFigures(), np.random.default_rng(seed)
    by_kill = rng.permutation([True] * kills + [False] * drops)
    with storage_proxy(server.port) as proxy, _uploader(server, proxy) as uploader:
        for upload, begin in enumerate(range(0, len(by_kill), CUTS_AN_UPLOAD)):
            prefix = f"cuts-{upload}"
            there: dict[str, bytes] = {}
            for kill in by_kill[begin : begin + CUTS_AN_UPLOAD]:
                proxy.restore()
                left = _bytes_of(folder) - sum(map(len, there.values()))
                proxy.budget = int(rng.integers(0, max(1, left)))
                _cut(uploader, proxy, f"s3://{BUCKET}/{prefix}", folder, kill=bool(kill), figures=figures)
                there = _compare(there, _objects(prefix, known=there), figures)
            proxy.restore()
            if uploader.run(f"s3://{BUCKET}/{prefix}", folder) != 0:
                raise DeviceFault(f"the upload {prefix} did not end after its cuts; run the bench again")
            _check_end(prefix, folder, figures)
    return {name: getattr(figures, name) for name in CutFigures.__slots__}


def resent_figures(server: StorageServer, folder: Path, *, cuts: int, seed: int = 2) -> Figures:
    """Cut the upload of one large file, by killing and by dropping, complete it, and return what was sent.

    `resent_ratio`: bytes sent, with those of HTTP, over the file's; `resent_parts_a_cut`: parts sent beyond
    it.
    """
    rng, figures, url = np.random.default_rng(seed), CutFigures(), f"s3://{BUCKET}/large"
    path = folder / "large.fcap"
    content = rng.bytes(LARGE_PARTS * LARGE_PART_BYTES)
    path.write_bytes(content)
    with storage_proxy(server.port) as proxy, _uploader(server, proxy, LARGE_PART_BYTES) as uploader:
        for kill in rng.permutation([True, False] * (cuts // 2)):
            proxy.restore()
            proxy.budget = int(rng.integers(0, len(content) // cuts))
            _cut(uploader, proxy, url, path, kill=bool(kill), figures=figures)
        proxy.restore()
        if uploader.run(url, path) != 0:
            raise DeviceFault(f"the upload {url} did not end after its cuts; run the bench again")
        sent = proxy.sent
    if find_item(url, "recordings", "bench").read("recording.fcap") != content:
        raise DeviceFault(f"{url} is not what was sent; run the bench again")
    more = (sent - len(content)) / LARGE_PART_BYTES
    return {
        "resent_cuts": figures.cuts,
        "resent_ratio": round(sent / len(content), 3),
        "resent_parts_a_cut": round(more / max(1, figures.cuts), 2),
    }


class _Uploader:
    """The process that forks uploaders."""

    def __init__(self, commands: IO[str], answers: IO[str], *, part_bytes: int) -> None:
        self._commands, self._answers, self._part_bytes = commands, answers, part_bytes

    def start(self, url: str, place: Path) -> int:
        """Start an uploader and return its process id."""
        self._commands.write(f"{url}\t{place}\t{self._part_bytes}\n")
        self._commands.flush()
        return int(self._answers.readline())

    def wait(self) -> int:
        """Return the exit status of the uploader."""
        return int(self._answers.readline())

    def run(self, url: str, place: Path) -> int:
        """Upload to the end."""
        self.start(url, place)
        return self.wait()


@contextmanager
def _uploader(
    server: StorageServer, proxy: StorageProxy, part_bytes: int = PART_BYTES
) -> Iterator[_Uploader]:
    environment = {**os.environ, **server.environment, ENDPOINT: f"http://127.0.0.1:{proxy.port}"}
    command = [sys.executable, "-m", "foveacam_bench.archive.uploader"]
    with subprocess.Popen(  # noqa: S603 - the project's own module
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=environment,
    ) as process:
        if process.stdin is None or process.stdout is None:
            raise AssertionError("both were asked for")
        try:
            yield _Uploader(process.stdin, process.stdout, part_bytes=part_bytes)
        finally:
            process.kill()


def _cut(
    uploader: _Uploader, proxy: StorageProxy, url: str, place: Path, *, kill: bool, figures: CutFigures
) -> None:
    """Upload until the proxy's budget of bytes is spent, and cut there."""
    child = uploader.start(url, place)
    if kill:
        proxy.wait_until_gone()
        with suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
    status = uploader.wait()
    figures.cuts += status != 0
    figures.kills += status == -signal.SIGKILL


def _compare(before: Mapping[str, bytes], after: dict[str, bytes], figures: CutFigures) -> dict[str, bytes]:
    """Count what a cut lost and damaged; return what is stored after it."""
    figures.lost += sum(name not in after for name in before)
    figures.damaged += _damaged(after)
    return after


def _check_end(prefix: str, folder: Path, figures: CutFigures) -> None:
    """Fetch what was archived, and compare it file by file."""
    figures.damaged += _damaged(_objects(prefix))
    record = find_item(f"s3://{BUCKET}/{prefix}", "captures", "bench")
    copy = folder.with_name("copy")
    shutil.rmtree(copy, ignore_errors=True)
    fetch_item(record, {name: copy / name for name in record.manifest.files}, watch=lambda done, total: None)
    for path in _files(folder):
        fetched = copy / path.relative_to(folder)
        if not fetched.is_file():
            figures.lost += 1
        elif fetched.read_bytes() != path.read_bytes():
            figures.damaged += 1


def _damaged(objects: Mapping[str, bytes]) -> int:
    """Count the objects whose content does not match their key."""
    named = {key: content for key, content in objects.items() if not key.endswith("manifest.json")}
    return sum(hashlib.sha256(content).hexdigest() not in key for key, content in named.items())


def _objects(prefix: str, *, known: Mapping[str, bytes] | None = None) -> dict[str, bytes]:
    """Return all objects of an upload by key; those that are `known` are not read again."""
    store, read = open_store(f"s3://{BUCKET}/{prefix}"), known or {}
    return {key: read[key] if key in read else store.read(key) for key in store.sizes("")}


def _bytes_of(folder: Path) -> int:
    return sum(path.stat().st_size for path in _files(folder))


def _files(folder: Path) -> list[Path]:
    own = (LOCK, RECORD)
    return [path for path in folder.rglob("*") if path.is_file() and path.name not in own]
