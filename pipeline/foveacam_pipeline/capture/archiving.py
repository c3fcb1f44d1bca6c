"""Datasets, stills and recordings as items of an archive: their files, and which need not stay on the disk.

A still is a dataset of one point.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path

from pydantic import JsonValue

from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.dataset.journal import IMAGE_FILE
from foveacam_pipeline.capture.dataset.lock import LOCK
from foveacam_pipeline.capture.recording.reader import archive_record_path, archived_name
from foveacam_pipeline.capture.recording.values import OLD_SUFFIX, SUFFIX
from foveacam_pipeline.storage.archive import RECORD, ArchiveItem, ArchiveManifest, ItemKind, read_record
from foveacam_pipeline.storage.disk import PART


def dataset_item(dataset: Dataset, *, item_id: str, kind: ItemKind = "captures") -> ArchiveItem:
    """Return a dataset, or a still, as an item.

    Its frames need not stay; its description, journal and products do.
    """
    folder, header = dataset.folder, dataset.document.header
    found = (path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    names = {path.relative_to(folder).as_posix() for path in found if not path.name.endswith(PART)}
    record = folder / RECORD
    archived = read_record(record)
    names |= set(archived.manifest.files if archived is not None else ())
    names -= {LOCK, RECORD}
    frames = {frame.file for point in dataset for frame in point.frames}
    return ArchiveItem(
        kind=kind,
        id=item_id,
        name=folder.name,
        label=header.label,
        created_utc=header.created_utc,
        files={name: folder / name for name in names},
        large=frozenset(frames & names),
        record=record,
    )


def place_of(manifest: ArchiveManifest, data: Path) -> Path:
    """Return the folder of a dataset or still, or the file of a recording, in a data directory."""
    home = data / manifest.kind
    if manifest.kind != "recordings":
        return home / manifest.name
    (name,) = (name for name in manifest.files if is_large(manifest, name))
    return home / f"{manifest.name}{Path(name).suffix}"


def paths_of(manifest: ArchiveManifest, place: Path) -> dict[str, Path]:
    """Return the paths of an archived item's files at its place."""
    if manifest.kind != "recordings":
        return {name: place / name for name in manifest.files}
    prefix = archived_name(place)
    return {name: place.with_name(place.name + name.removeprefix(prefix)) for name in manifest.files}


def record_at(manifest: ArchiveManifest, place: Path) -> Path:
    """Return the path of an item's record at its place."""
    return archive_record_path(place) if manifest.kind == "recordings" else place / RECORD


def is_large(manifest: ArchiveManifest, name: str) -> bool:
    """Return whether a file of an item need not be on the disk."""
    if manifest.kind != "recordings":
        return IMAGE_FILE.fullmatch(name) is not None
    return name in (f"recording{suffix}" for suffix in (SUFFIX, OLD_SUFFIX))


def recording_item(
    path: Path,
    *,
    item_id: str,
    label: str,
    created_utc: str,
    beside: Iterable[Path],
    about: Mapping[str, JsonValue],
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
        about=about,
    )
