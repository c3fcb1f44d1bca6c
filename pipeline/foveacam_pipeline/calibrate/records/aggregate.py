"""Combination of the sweeps of one rig from several sessions into one session; `fit` fits them."""

import itertools
import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, SweepHeader, sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep, save_sweep
from foveacam_pipeline.models.content import content_id, plain

SOURCES_FILE = "sources.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepSource:
    """Source of a sweep. `sweep_id`: hash of its content. `repeated`: the same sweep was given before."""

    path: Path
    sweep_id: str
    station: str
    poses: int
    repeated: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CombinedSweeps:
    """Sweeps that one calibration can be fitted to."""

    rig_id: str
    sweeps: tuple[Sweep, ...]
    sources: tuple[SweepSource, ...]

    @property
    def label(self) -> str:
        """Label for the calibration fitted to them."""
        poses = sum(len(sweep.poses) for sweep in self.sweeps)
        return f"combined from {len(self.sweeps)} sweeps of {poses} poses"


def sweep_id(sweep: Sweep) -> str:
    """Return the id of a sweep: the hash of its content."""
    return content_id(plain(sweep))


def collect_sweeps(paths: Sequence[Path], *, rig_id: str) -> CombinedSweeps:
    """Read sweeps of one rig with one set of cameras, without repeated ones; raise InvalidInput otherwise."""
    known: dict[str, Sweep] = {}
    sources = []
    for path in paths:
        sweep = load_sweep(path)
        _check_rig(path, sweep, rig_id)
        name = sweep_id(sweep)
        sources.append(
            SweepSource(
                path=path,
                sweep_id=name,
                station=sweep.header.station.name,
                poses=len(sweep.poses),
                repeated=name in known,
            )
        )
        known.setdefault(name, sweep)
    sweeps = tuple(known.values())
    if not sweeps:
        raise InvalidInput("no sweep was given to put together; name sessions that hold one")
    for path, sweep in zip([s.path for s in sources if not s.repeated], sweeps, strict=True):
        _check_alike(path, sweep.header, sweeps[0].header)
    return CombinedSweeps(rig_id=rig_id, sweeps=sweeps, sources=tuple(sources))


def sweep_paths(session: Path) -> tuple[Path, ...]:
    """Return the files of a session's sweeps."""
    return tuple(sorted(session.glob("sweep-*.jsonl")))


def combine_sessions(sessions: Sequence[Path], into: Path, *, rig_id: str, wide_from: Path) -> CombinedSweeps:
    """Write a new session folder with all sweeps of other sessions and the wide camera of one of them.

    `into` must not exist yet; it is written atomically. `sources.json` lists the sources. A station that
    several sessions swept is stored once for each, oldest first: `markers`, `markers (2)`. Moves of the
    mounts between the sessions are fitted like those between runs of one session, where nodes were visited
    again; without such visits only moves of more than 0.01° are corrected.
    """
    combined = collect_sweeps([path for session in sessions for path in sweep_paths(session)], rig_id=rig_id)
    if not (wide_from / "wide.json").is_file():
        raise InvalidInput(f"session {wide_from} holds no wide.json; name one with a calibrated wide camera")
    if into.exists():
        raise InvalidInput(f"session {into} exists already, nothing was overwritten; give a new one")
    beside = into.with_name(f".{into.name}.part")
    try:
        _write_session(beside, combined, wide_from)
        beside.replace(into)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return combined


def _write_session(folder: Path, combined: CombinedSweeps, wide_from: Path) -> None:
    folder.mkdir(parents=True)
    files = (path for found in wide_from.glob("wide*") for path in (found, *found.rglob("*")))
    for path in files:  # one by one: `copytree` collects its errors and loses the errno of the disk
        target = folder / path.relative_to(wide_from)
        if path.is_dir():
            target.mkdir()
        else:
            shutil.copy2(path, target)
    taken: set[str] = set()
    for sweep in sorted(combined.sweeps, key=lambda sweep: sweep.header.created_utc):
        named = _with_unique_name(sweep, taken)
        save_sweep(named, folder / sweep_filename(named.header.station))
    listing = {"wide": str(wide_from), "sweeps": [_source_document(source) for source in combined.sources]}
    (folder / SOURCES_FILE).write_text(json.dumps(listing, indent=1) + "\n", encoding="utf-8")


def _with_unique_name(sweep: Sweep, taken: set[str]) -> Sweep:
    """Return the sweep under a station name whose file name is not in `taken`, and add it there."""
    station = sweep.header.station
    names = (f"{station.name} ({number})" if number > 1 else station.name for number in itertools.count(1))
    for name in names:
        renamed = replace(station, name=name)
        if sweep_filename(renamed) not in taken:
            taken.add(sweep_filename(renamed))
            return replace(sweep, header=replace(sweep.header, station=renamed))
    raise AssertionError("names do not end")


def _source_document(source: SweepSource) -> dict[str, str | int | bool]:
    return {
        "path": str(source.path),
        "sweep_id": source.sweep_id,
        "station": source.station,
        "poses": source.poses,
        "repeated": source.repeated,
    }


def _check_rig(path: Path, sweep: Sweep, rig_id: str) -> None:
    if sweep.header.rig_id != rig_id:
        raise InvalidInput(
            f"sweep {path} is of rig {sweep.header.rig_id!r}, this one is {rig_id!r}; "
            "put together sweeps of one rig"
        )


def _check_alike(path: Path, header: SweepHeader, first: SweepHeader) -> None:
    for name in ("wide_size", "fovea_size", "wide_serial", "left_serial", "right_serial"):
        found, needed = getattr(header, name), getattr(first, name)
        if found != needed:
            raise InvalidInput(
                f"sweep {path}: {name} is {found!r}, another sweep has {needed!r}; "
                "put together sweeps of the same cameras"
            )
