"""A reference in its dataset's folder: `reference/`, a document that names the other files, and these."""

import csv
import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import asdict, astuple, fields
from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset.reference_folder import (
    REFERENCE,
    REFERENCE_DOCUMENT,
    REFERENCE_FORMAT,
    REFERENCE_PICTURE,
    REFERENCE_SAMPLES,
    REFERENCE_VERSION,
    begin_reference,
    finish_reference,
    remove_unfinished_reference,
)
from foveacam_pipeline.capture.reference.plot import comparison_pictures
from foveacam_pipeline.capture.reference.values import ReferenceSample, WideBaselineReference
from foveacam_pipeline.storage.disk import disk_errors, sync_folder, write_file


def write_reference(dataset: Path, reference: WideBaselineReference) -> Path:
    """Put a reference beside the frames of a dataset; return its folder. It takes an older one's place.

    Raise StorageFull or DeviceFault when the disk does not take it.
    """
    contents = {REFERENCE_SAMPLES: rows_text(reference.rows).encode()}
    pictures = comparison_pictures(reference)
    contents |= {f"{REFERENCE_PICTURE}.{form}": content for form, content in pictures.items()}
    document = {
        "format": REFERENCE_FORMAT,
        "version": REFERENCE_VERSION,
        "recipe": reference.recipe,
        "figures": asdict(reference.figures),
        "files": {
            f"{REFERENCE}/{name}": hashlib.sha256(content).hexdigest() for name, content in contents.items()
        },
    }
    text = json.dumps(document, indent=1, allow_nan=False) + "\n"
    contents[REFERENCE_DOCUMENT] = text.encode()
    with disk_errors("the reference", dataset):
        try:
            making = begin_reference(dataset)
            for name, content in contents.items():
                write_file(making / name, content)
            folder = finish_reference(dataset)
            sync_folder(dataset)
        finally:
            remove_unfinished_reference(dataset)
    return folder


def read_rows(dataset: Path) -> tuple[ReferenceSample, ...]:
    """Return the samples of a dataset's reference; raise InvalidInput when there is none to read."""
    path = dataset / REFERENCE / REFERENCE_SAMPLES
    kinds = {field.name: field.type for field in fields(ReferenceSample)}
    try:
        with path.open(newline="", encoding="utf-8") as file:
            return tuple(
                ReferenceSample(**{name: kinds[name](text) for name, text in row.items()})  # type: ignore[operator]  # field types are classes here
                for row in csv.DictReader(file)
            )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InvalidInput(f"{path} cannot be read ({error}); make the reference again") from error


def rows_text(rows: Sequence[ReferenceSample]) -> str:
    """Return samples as CSV; numbers keep every bit."""
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(field.name for field in fields(ReferenceSample))
    table.writerows(astuple(row) for row in rows)
    return out.getvalue()
