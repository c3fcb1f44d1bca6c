"""Export for Hugging Face's `datasets`: parquet files that contain the images, and a dataset card.

`load_dataset("path/of/the/export")` needs nothing else. Writing parquet needs pyarrow, the extra `export`.
"""

import json
import shutil
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

from foveacam_hardware.contract import InvalidInput, Role, install_command
from foveacam_pipeline.capture.dataset.document import DOCUMENT
from foveacam_pipeline.capture.dataset.export.point_numbers import ANGLES, NUMBERS, numbers_of
from foveacam_pipeline.capture.dataset.export.target import ExportChoice
from foveacam_pipeline.capture.dataset.images import ImageCodec, encode
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint

POINTS_A_FILE = 64
PICTURES = tuple(role.value for role in (Role.LEFT, Role.RIGHT, Role.WIDE))


def export_hugging_face(dataset: Dataset, folder: Path, choice: ExportChoice) -> None:
    """Write data/*.parquet, README.md and the dataset's `dataset.json` into an empty folder."""
    arrow, parquet = pyarrow_modules()
    schema = _schema(arrow)
    files = [dataset[start : start + POINTS_A_FILE] for start in range(0, len(dataset), POINTS_A_FILE)]
    (folder / "data").mkdir()
    for number, part in enumerate(files):
        path = folder / "data" / f"train-{number:05d}-of-{len(files):05d}.parquet"
        with parquet.ParquetWriter(path, schema, compression="none") as writer:
            for point in part:
                writer.write_table(arrow.Table.from_pylist(list(rows_of(point)), schema=schema))
                choice.report_point(point.index)
    (folder / "README.md").write_text(card(dataset), encoding="utf-8")
    shutil.copyfile(dataset.folder / DOCUMENT, folder / DOCUMENT)


def rows_of(point: DatasetPoint) -> Iterator[dict[str, object]]:
    """Yield one row per bracket: numbers, and images as PNG in the form that `datasets` expects."""
    for bracket in point.brackets:
        yield {
            **numbers_of(point, bracket),
            **{name: _picture(point, Role(name), bracket) for name in PICTURES},
        }


def features() -> dict[str, dict[str, str]]:
    """Return the columns with their types as `datasets` names them."""
    return {
        **{name: {"dtype": "int64", "_type": "Value"} for name in NUMBERS},
        **{name: {"dtype": "float64", "_type": "Value"} for name in ANGLES},
        **{name: {"_type": "Image"} for name in PICTURES},
    }


def card(dataset: Dataset) -> str:
    """Return README.md: the metadata block for `datasets`, and a description for people."""
    header = dataset.document.header
    lines = [
        "---",
        "license: other",
        f"license_name: {json.dumps(header.licence)}",
        "configs:",
        "- config_name: default",
        "  data_files:",
        "  - split: train",
        "    path: data/train-*.parquet",
        "---",
        f"# {header.label or dataset.folder.name}",
        "",
        f"{len(dataset)} points of a foveated stereo rig, taken {header.created_utc}: raw left and right "
        "fovea and the wide view, gaze angles (rad) and mirror volts of every exposure.",
        f"The calibration, plan and conditions are in `{DOCUMENT}`. Licence: {header.licence}.",
    ]
    return "\n".join(lines) + "\n"


def _picture(point: DatasetPoint, role: Role, bracket: int) -> dict[str, object] | None:
    bracket = 0 if role is Role.WIDE else bracket
    if not any(frame.role is role and frame.bracket == bracket for frame in point.frames):
        return None
    frame = point.stacked(role, bracket=bracket)
    name = f"{point.index:05d}-{role.value}-b{bracket}.png"
    return {"bytes": bytes(encode(frame.image, ImageCodec.PNG)), "path": name}


def _schema(arrow: ModuleType) -> object:
    picture = arrow.struct([("bytes", arrow.binary()), ("path", arrow.string())])
    columns = [
        *((name, arrow.int64()) for name in NUMBERS),
        *((name, arrow.float64()) for name in ANGLES),
        *((name, picture) for name in PICTURES),
    ]
    metadata = {"huggingface": json.dumps({"info": {"features": features()}})}
    return arrow.schema(columns, metadata=metadata)


def pyarrow_modules() -> tuple[ModuleType, ModuleType]:
    """Return pyarrow and its module of parquet; raise `InvalidInput` where it is not installed."""
    try:
        return import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError as error:
        raise InvalidInput(
            f"an export for Hugging Face needs pyarrow, which is not installed; {install_command('export')}"
        ) from error
