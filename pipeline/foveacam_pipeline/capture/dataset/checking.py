"""Compares a dataset's files with its records (`check_dataset`), and counts its contents (`dataset_info`)."""

import hashlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from foveacam_hardware.contract import FoveaError, Role
from foveacam_pipeline.capture.dataset.document import (
    DOCUMENT,
    DatasetDocument,
    permanent_hash,
    read_document,
)
from foveacam_pipeline.capture.dataset.index import INDEX, index_text
from foveacam_pipeline.capture.dataset.journal import JOURNAL, JournalContent, read_journal
from foveacam_pipeline.capture.dataset.lock import LOCK, is_being_written
from foveacam_pipeline.capture.dataset.point_store import IMAGE_FILE_NAME
from foveacam_pipeline.capture.dataset.reader import INTERRUPTED, Dataset
from foveacam_pipeline.capture.dataset.rectified import PAIRS, RECTIFIED, PairRow, read_pairs
from foveacam_pipeline.capture.dataset.reference_folder import REFERENCE, REFERENCE_DOCUMENT, reference_files
from foveacam_pipeline.capture.dataset.values import DatasetState, FrameRecord
from foveacam_pipeline.storage.archive import RECORD, ArchiveRecord, read_record
from foveacam_pipeline.storage.disk import PART

_BLOCK = 1 << 20
Content = TypeVar("Content")


def check_dataset(path: str | Path) -> list[str]:
    """Return the problems of a dataset, one sentence each; empty when all files and numbers are intact."""
    folder = Path(path)
    try:
        document = read_document(folder)
        journal = read_journal(folder, dataset_id=document.header.id)
    except FoveaError as error:
        return [f"{error}."]
    interrupted = document.state is DatasetState.RUNNING and not is_being_written(folder)
    problems: list[str] = []
    pairs = _read_or_report(read_pairs, folder, problems) or ()
    reference = _read_or_report(reference_files, folder, problems) or {}
    return [
        *_states(folder, document, journal),
        *_counts(document, journal),
        *_frame_counts(document, journal),
        *_frames(folder, journal),
        *_index(folder, journal, interrupted=interrupted),
        *problems,
        *_pair_files(folder, pairs),
        *_reference_files(folder, reference),
        *_unknown_files(folder, journal, pairs, reference, ended=document.state is DatasetState.COMPLETE),
    ]


def _read_or_report(reader: Callable[[Path], Content], folder: Path, problems: list[str]) -> Content | None:
    """Return the result of `reader`; on failure add the error to `problems` and return None."""
    try:
        return reader(folder)
    except FoveaError as error:
        problems.append(f"{error}.")
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetInfo:
    """A dataset in figures. `sizes_px`: role -> "width x height, bits".

    `why`: why a partial dataset ended.
    """

    name: str
    id: str
    label: str
    state: str
    why: str
    licence: str
    created_utc: str
    software: dict[str, str]
    rig: dict[str, object]
    calibration_id: str | None
    planned: int
    points: int
    skipped: int
    scans: int
    frames: int
    brackets: int
    stack: int
    rectified: int
    size_bytes: int
    sizes_px: dict[str, str]


def dataset_info(path: str | Path) -> DatasetInfo:
    """Return the figures of a dataset; raise InvalidInput when the folder holds none."""
    dataset = Dataset.open(path)
    document, header = dataset.document, dataset.document.header
    frames = [frame for point in dataset for frame in point.frames]
    foveae = [(frame.bracket, frame.stack) for frame in frames]
    return DatasetInfo(
        name=dataset.folder.resolve().name,
        id=header.id,
        label=header.label,
        state=document.state.value,
        why=document.why,
        licence=header.licence,
        created_utc=header.created_utc,
        software=document.software,
        rig=dict(header.rig),
        calibration_id=None if header.calibration is None else header.calibration.id,
        planned=header.points,
        points=len(dataset),
        skipped=len(dataset.skipped),
        scans=len(dataset.scans),
        frames=len(frames),
        brackets=len({bracket for bracket, _ in foveae}),
        stack=len({stack for _, stack in foveae}),
        rectified=len(read_pairs(dataset.folder)),
        size_bytes=sum(frame.size_bytes for frame in frames),
        sizes_px={frame.role.value: f"{frame.width} x {frame.height}, {frame.bits} bits" for frame in frames},
    )


def _states(folder: Path, document: DatasetDocument, journal: JournalContent) -> Iterator[str]:
    held = is_being_written(folder)
    if document.stated_hash != permanent_hash(document):
        yield f"{DOCUMENT}: something but state, label and licence was changed after it was written."
    if document.state is DatasetState.RUNNING and not held:
        yield f"{DOCUMENT}: the dataset was {INTERRUPTED}."
    if journal.torn and not held:
        yield (
            f"{JOURNAL}: its last line is torn: a point was being written when the program ended; "
            "resume the dataset, which takes that point again."
        )


def _counts(document: DatasetDocument, journal: JournalContent) -> Iterator[str]:
    planned, found = document.header.points, len(journal.records)
    if found > planned:
        yield f"{JOURNAL}: {found} points, {planned} were planned."
    if document.state is DatasetState.COMPLETE and found < planned:
        yield f"{DOCUMENT}: it is marked complete, but {planned - found} of {planned} points are missing."


def _frame_counts(document: DatasetDocument, journal: JournalContent) -> Iterator[str]:
    """Compare each point's frame count with the most common one, counting wide frames as the plan asks."""
    taken = [record for record in journal.records if record.frames]
    wides = {record.place.index: sum(f.role is Role.WIDE for f in record.frames) for record in taken}
    foveae = _most_common([len(record.frames) - wides[record.place.index] for record in taken])
    first: dict[int, int] = {}
    for record in journal.records:
        first.setdefault(record.place.scan, record.place.index)
    once, usual_wides = document.header.plan.get("wide") == "scan", _most_common([*wides.values()])
    for record in taken:
        begins = first[record.place.scan] == record.place.index
        wanted, here = foveae + (int(begins) if once else usual_wides), len(record.frames)
        if here != wanted:
            yield f"point {record.place.index}: it has {here} frames, by plan and other points {wanted}."


def _most_common(counts: list[int]) -> int:
    return Counter(counts).most_common(1)[0][0] if counts else 0


def _frames(folder: Path, journal: JournalContent) -> Iterator[str]:
    archived = read_record(folder / RECORD)
    seen: Counter[str] = Counter(frame.file for record in journal.records for frame in record.frames)
    yield from (f"{file}: {count} rows name it." for file, count in seen.items() if count > 1)
    for record in journal.records:
        for frame in record.frames:
            yield from frame_problems(folder, frame, archived)


def frame_problems(folder: Path, frame: FrameRecord, archived: ArchiveRecord | None) -> Iterator[str]:
    """Yield a sentence for a frame whose file, here or in the archive, is missing or has changed."""
    path = folder / frame.file
    if archived is not None and frame.file in archived.manifest.files and not path.exists():
        if archived.manifest.files[frame.file].sha256 != frame.sha256:
            yield f"{frame.file}: the archive holds other content than what was written (SHA-256)."
        return
    if not path.is_file() or path.is_symlink():
        yield f"{frame.file}: the file is gone."
        return
    size = path.stat().st_size
    if size != frame.size_bytes:
        yield f"{frame.file}: it has {size} bytes, {frame.size_bytes} were written."
    elif sha256_of(path) != frame.sha256:
        yield f"{frame.file}: its content is not what was written (SHA-256)."


def _index(folder: Path, journal: JournalContent, *, interrupted: bool) -> Iterator[str]:
    path = folder / INDEX
    wanted = index_text(journal.records).splitlines()
    try:
        found = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        yield f"{INDEX}: it cannot be read ({error}); resume the dataset or export it anew."
        return
    if is_being_written(folder) or found == wanted:
        return
    if interrupted and found == wanted[: len(found)]:
        return  # the index is written when the dataset ends: until then it may lack points
    first = next(
        (n for n, pair in enumerate(zip(found, wanted, strict=False), 1) if pair[0] != pair[1]),
        min(len(found), len(wanted)) + 1,
    )
    yield (
        f"{INDEX}: line {first} differs from the journal ({len(found)} lines, not {len(wanted)}): it "
        f"was edited by hand or by another program; the reader goes by {JOURNAL}."
    )


def _pair_files(folder: Path, pairs: tuple[PairRow, ...]) -> Iterator[str]:
    for pair in pairs:
        files = (
            (pair.left, pair.left_sha256),
            (pair.right, pair.right_sha256),
            (pair.disparity, pair.disparity_sha256),
        )
        for file, digest in files:
            path = folder / file
            if file and Path(file).parent != Path(RECTIFIED):
                yield f"{RECTIFIED}/{PAIRS}: {file!r} is not in that folder."
            elif file and not path.is_file():
                yield f"{file}: the file is gone; rectify the dataset again."
            elif file and sha256_of(path) != digest:
                yield f"{file}: its content is not what was written (SHA-256); rectify the dataset again."


def _reference_files(folder: Path, reference: dict[str, str]) -> Iterator[str]:
    for file, digest in reference.items():
        path = folder / file
        if not path.is_file():
            yield f"{file}: the file is gone; make the reference again."
        elif sha256_of(path) != digest:
            yield f"{file}: its content is not what was written (SHA-256); make the reference again."


def _unknown_files(
    folder: Path,
    journal: JournalContent,
    pairs: tuple[PairRow, ...],
    reference: dict[str, str],
    *,
    ended: bool,
) -> Iterator[str]:
    """Name files that do not belong to the dataset, except unfinished ones, which a resume removes."""
    known = {
        DOCUMENT,
        JOURNAL,
        INDEX,
        LOCK,
        RECORD,
        f"{RECTIFIED}/{PAIRS}",
        f"{REFERENCE}/{REFERENCE_DOCUMENT}",
    }
    known |= set(reference)
    known |= {frame.file for record in journal.records for frame in record.frames}
    known |= {file for pair in pairs for file in (pair.left, pair.right, pair.disparity)}
    if is_being_written(folder):
        return
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        begun = not ended and (path.suffix == PART or IMAGE_FILE_NAME.fullmatch(path.name) is not None)
        if not path.is_dir() and name not in known and not begun:
            yield f"{name}: the dataset does not know this file."


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file's content, read block by block."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()
