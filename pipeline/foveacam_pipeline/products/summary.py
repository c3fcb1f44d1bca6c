"""Summary of a batch: a JSON document, a table (CSV) and one picture, from the products on disk."""

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pydantic import TypeAdapter

from foveacam_pipeline.capture.dataset.images import decode
from foveacam_pipeline.diagrams import figures_installed, new_figure
from foveacam_pipeline.learn.truth_figures import TruthSums, truth_figures
from foveacam_pipeline.products.batch import BatchFailure, BatchPlan
from foveacam_pipeline.products.making import PICTURE
from foveacam_pipeline.products.results import Figures, ProductDocument, ProductFolder
from foveacam_pipeline.products.task import ProductKind, ProductTask
from foveacam_pipeline.storage.disk import disk_errors, write_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FORMAT, VERSION = "foveacam-batch", 1
MOST_PICTURED = 64
"""Largest number of datasets in the picture; the table lists all."""
COLUMNS = 4
_TRUTH = "truth_"


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetSummary:
    """The products of one dataset: how many are planned, how many exist, and its figures."""

    name: str
    planned: int
    done: int
    figures: Figures
    picture: Path | None


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchSummary:
    """State of a batch on disk. `paths`: the summary files."""

    complete: bool
    planned: int
    done: int
    datasets: tuple[DatasetSummary, ...]
    paths: tuple[Path, ...]


def write_summary(plan: BatchPlan, into: ProductFolder, failures: Sequence[BatchFailure]) -> BatchSummary:
    """Write KIND.json, KIND.csv and KIND.png beside the products; return them. Raise as `disk_errors`.

    There is no picture without Matplotlib.
    """
    found = [(task, into.find(task)) for task in plan.tasks]
    kind = plan.settings.kind
    by_dataset = groupby(found, key=lambda pair: pair[0].folder)  # the plan has them dataset by dataset
    datasets = tuple(_dataset(list(pairs), into) for _, pairs in by_dataset)
    done = sum(product is not None for _, product in found)
    document = {
        "format": FORMAT,
        "version": VERSION,
        "kind": kind.value,
        "parameters": plan.settings.parameters(),
        "code": plan.tasks[0].code,
        "planned": len(found),
        "done": done,
        "datasets": [
            {"name": one.name, "planned": one.planned, "done": one.done, **one.figures} for one in datasets
        ],
        "products": [
            {"dataset": task.name, "unit": task.unit, "folder": f"{kind.value}/{task.key}", **product.figures}
            for task, product in found
            if product is not None
        ],
        "failed": [asdict(failure) for failure in failures],
    }
    contents = {
        into.path / f"{kind.value}.json": (json.dumps(document, indent=1, allow_nan=False) + "\n").encode(),
        into.path / f"{kind.value}.csv": _table(found, kind).encode(),
    }
    if figures_installed():
        contents[into.path / f"{kind.value}.png"] = _picture(kind, datasets)
    with disk_errors("the summary of a batch", into.path):
        for path, content in contents.items():
            write_file(path, content)
    return BatchSummary(
        complete=done == len(found) and not failures,
        planned=len(found),
        done=done,
        datasets=datasets,
        paths=tuple(contents),
    )


def evaluation_figures(rows: Sequence[Figures]) -> Figures:
    """Return the figures of several evaluated pairs from their sums; null where nothing was compared."""
    total = {name: sum(row.get(name) or 0 for row in rows) for row in rows[:1] for name in row}
    figures: Figures = {
        "answered": _share(total["answered"], total["shown"]),
        "photometric": _share(total["photometric"], total["compared"]),
        "left_right_agreed": _share(total["agreed"], total["judged"]),
    }
    sums = [_truth_sums(row) for row in rows if f"{_TRUTH}seen" in row]
    truth = truth_figures(sums)
    return (
        figures
        if truth is None
        else figures | {f"{_TRUTH}{key}": value for key, value in asdict(truth).items()}
    )


def _truth_sums(row: Figures) -> TruthSums:
    truth = {name.removeprefix(_TRUTH): value for name, value in row.items() if name.startswith(_TRUTH)}
    return TypeAdapter(TruthSums).validate_python(truth)


def _share(part: float, whole: float) -> float | None:
    return part / whole if whole else None


def _dataset(
    found: Sequence[tuple[ProductTask, ProductDocument | None]], into: ProductFolder
) -> DatasetSummary:
    products = [(task, product) for task, product in found if product is not None]
    kind, rows = found[0][0].settings.kind, [product.figures for _, product in products]
    figures: Figures = {}
    if rows and kind is ProductKind.EVALUATE:
        figures = evaluation_figures(rows)
    elif rows and kind in (ProductKind.DEPTH, ProductKind.MOSAIC):
        figures = {"known": float(np.mean([row["known"] or 0.0 for row in rows]))}
    picture = None
    if products and kind in PICTURE:
        picture = into.place(products[len(products) // 2][0]) / PICTURE[kind]
    return DatasetSummary(
        name=found[0][0].name, planned=len(found), done=len(products), figures=figures, picture=picture
    )


def _table(found: Sequence[tuple[ProductTask, ProductDocument | None]], kind: ProductKind) -> str:
    names = list(dict.fromkeys(name for _, product in found if product for name in product.figures))
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(["dataset", "unit", "folder", *names])
    for task, product in found:
        if product is not None:
            values = [product.figures.get(name) for name in names]
            table.writerow([task.name, task.unit, f"{kind.value}/{task.key}", *values])
    return out.getvalue()


def _picture(kind: ProductKind, datasets: Sequence[DatasetSummary]) -> bytes:
    """Return a PNG: a thumbnail for each dataset, or the figures of an evaluation as bars."""
    shown = datasets[:MOST_PICTURED]
    left_out = f", the first {len(shown)} of {len(datasets)}" if len(shown) < len(datasets) else ""
    title = f"{kind.value}, {len(datasets)} dataset{'s' * (len(datasets) > 1)}{left_out}"
    if kind is ProductKind.EVALUATE:
        figure = new_figure((10.0, 1.8 + 0.3 * len(shown)), dpi=100)
        _draw_bars(figure.subplots(1, 3, sharey=True), shown)
    else:
        columns = min(COLUMNS, len(shown))
        rows = -(-len(shown) // columns)
        figure = new_figure((3.4 * columns, 2.6 * rows + 0.5), dpi=100)
        for axis, one in zip(
            figure.subplots(rows, columns, squeeze=False).flat, [*shown, *[None] * COLUMNS], strict=False
        ):
            _draw_thumbnail(axis, one)
    figure.suptitle(title)
    content = io.BytesIO()
    figure.savefig(content, format="png", metadata={"Software": None})
    return content.getvalue()


def _draw_thumbnail(axis: "Axes", one: DatasetSummary | None) -> None:
    axis.set_axis_off()
    if one is None:
        return
    axis.set_title(f"{one.name}, {one.done} of {one.planned}", fontsize=8)
    if one.picture is not None:
        axis.imshow(decode(one.picture.read_bytes(), what=str(one.picture)))


def _draw_bars(axes: "Sequence[Axes]", shown: Sequence[DatasetSummary]) -> None:
    truth = any(f"{_TRUTH}epe_px" in one.figures for one in shown)
    error = (
        (f"{_TRUTH}epe_px", "mean error against the truth, px") if truth else ("answered", "pixels answered")
    )
    bars = (error, ("photometric", "photometric error (L1)"), ("left_right_agreed", "left and right agree"))
    places = range(len(shown))
    for axis, (name, title) in zip(axes, bars, strict=True):
        axis.barh(places, [one.figures.get(name) or 0.0 for one in shown], color="#2a6f97")
        axis.set_title(title, fontsize=9)
    axes[0].set_yticks(places, [one.name for one in shown], fontsize=8)
    axes[0].invert_yaxis()
