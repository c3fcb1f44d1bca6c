"""Datasets and recordings as items of an archive: their files, and which need not stay on the disk."""

from collections.abc import Iterable
from pathlib import Path

from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.dataset.lock import LOCK
from foveacam_pipeline.capture.recording.reader import archive_record_path, archived_name
from foveacam_pipeline.storage.archive import RECORD, ArchiveItem, read_record
from foveacam_pipeline.storage.disk import PART


def dataset_item(dataset: Dataset, *, item_id: str) -> ArchiveItem:
    """Return a dataset as an item; its frames need not stay, its description, journal and products do."""
    folder, header = dataset.folder, dataset.document.header
    found = (path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    names = {path.relative_to(folder).as_posix() for path in found if not path.name.endswith(PART)}
    record = folder / RECORD
    archived = read_record(record)
    names |= set(archived.manifest.files if archived is not None else ())
    names -= {LOCK, RECORD}
    frames = {frame.file for point in dataset for frame in point.frames}
    return ArchiveItem(
        kind="captures",
        id=item_id,
        name=folder.name,
        label=header.label,
        created_utc=header.created_utc,
        files={name: folder / name for name in names},
        large=frozenset(frames & names),
        record=record,
    )


def recording_item(
    path: Path, *, item_id: str, label: str, created_utc: str, beside: Iterable[Path]
) -> ArchiveItem:
    """Return a recording as an item; `beside`: the files that belong to it, which stay."""
    name = archived_name(path)
    others = {name + other.name.removeprefix(path.name): other for other in beside if other.is_file()}
    return ArchiveItem(
        kind="recordings",
        id=item_id,
        name=path.stem,
        label=label,
        created_utc=created_utc,
        files={name: path, **others},
        large=frozenset({name}),
        record=archive_record_path(path),
    )
