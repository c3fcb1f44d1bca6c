"""The files of a reference in its dataset's folder: document, samples as CSV, the comparison as a figure."""

import csv
import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import asdict, astuple, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

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
from foveacam_pipeline.capture.reference.compare import WRONG, columns
from foveacam_pipeline.capture.reference.values import (
    BaselineComparison,
    Floats,
    ReferenceSample,
    WideBaselineReference,
)
from foveacam_pipeline.diagrams import new_figure
from foveacam_pipeline.storage.disk import disk_errors, sync_folder, write_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DPI = 120
SHORT, LONG = "#d95f02", "#1f77b4"
LEAST_M = 1e-5


def write_reference(dataset: Path, reference: WideBaselineReference) -> Path:
    """Write a reference into `reference/` of a dataset, replacing an older one; return that folder.

    Raise StorageFull or DeviceFault on a disk error.
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


def rows_text(rows: Sequence[ReferenceSample]) -> str:
    """Return samples as CSV; numbers keep full precision."""
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(field.name for field in fields(ReferenceSample))
    table.writerows(astuple(row) for row in rows)
    return out.getvalue()


def comparison_pictures(reference: WideBaselineReference) -> dict[str, bytes]:
    """Return the comparison as a figure in SVG and PNG, by file suffix."""
    figure = new_figure((11.0, 5.2), dpi=DPI)
    sizes, relative = figure.subplots(1, 2)
    found = reference.figures.comparison
    depth, short, sigma = columns(reference.rows, "reference_m", "short_m", "sigma_m")
    _draw_errors(sizes, depth, short, sigma, reference=reference, found=found)
    _draw_relative_errors(relative, depth, short, sigma, found=found)
    figure.suptitle(_title(reference, found), fontsize=11)
    pictures = {}
    for form in ("svg", "png"):
        buffer = io.BytesIO()
        figure.savefig(buffer, format=form, metadata={"Date": None} if form == "svg" else None)
        pictures[form] = buffer.getvalue()
    return pictures


def _draw_errors(
    axes: "Axes",
    depth: Floats,
    short: Floats,
    sigma: Floats,
    *,
    reference: WideBaselineReference,
    found: BaselineComparison,
) -> None:
    figures = reference.figures
    apart = np.maximum(np.abs(short - depth), LEAST_M)
    axes.plot(depth, apart, ".", color=SHORT, alpha=0.25, markersize=3, rasterized=True)
    axes.plot(depth, sigma, ".", color=LONG, alpha=0.25, markersize=3, rasterized=True)
    at = [each.depth_m for each in found.bins]
    axes.plot(at, [each.rms_m for each in found.bins], "o", color=SHORT, label="short baseline, rms off it")
    axes.plot(
        at, [each.reference_sigma_m for each in found.bins], "s", color=LONG, label="reference, stated error"
    )
    axes.plot(
        at,
        [each.reference_own_sigma_m for each in found.bins],
        "v",
        color=LONG,
        label="of that, what samples do not share",
    )
    curve = np.geomspace(0.95 * depth.min(), 1.05 * depth.max(), 50)
    for baseline_m, colour in ((figures.short_baseline_m, SHORT), (figures.baseline_m, LONG)):
        expected = curve**2 / (baseline_m * reference.f_px) * found.disparity_rms_px
        label = f"Z² / (B f) · {found.disparity_rms_px:.2f} px, B = {1e3 * baseline_m:.0f} mm"
        axes.plot(curve, expected, "-", color=colour, linewidth=1.0, label=label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylabel("|dZ|, m")
    axes.set_title("size of the error", fontsize=10)
    _format_axes(axes)
    axes.legend(fontsize=8, loc="upper left")


def _draw_relative_errors(
    axes: "Axes", depth: Floats, short: Floats, sigma: Floats, *, found: BaselineComparison
) -> None:
    percent = 100.0 * (short / depth - 1.0)
    good = np.abs(percent) < 100.0 * WRONG
    axes.plot(depth[good], percent[good], ".", color=SHORT, alpha=0.35, markersize=3, rasterized=True)
    order = np.argsort(depth)
    band = 100.0 * (sigma / depth)[order]
    axes.fill_between(
        depth[order], -band, band, color=LONG, alpha=0.2, linewidth=0, label="reference, ±1 σ as stated"
    )
    axes.axhline(
        100.0 * found.bias_rel,
        color=SHORT,
        linestyle="--",
        linewidth=1.0,
        label=f"bias {100.0 * found.bias_rel:+.3f} %",
    )
    axes.set_xscale("log")
    axes.set_ylabel("short baseline off the reference, %")
    axes.set_title(f"relative error, rms {100.0 * found.rms_rel:.3f} %", fontsize=10)
    _format_axes(axes)
    axes.legend(fontsize=8, loc="upper left")


def _format_axes(axes: "Axes") -> None:
    from matplotlib.ticker import NullFormatter, ScalarFormatter

    axes.set_xlabel("depth Z, m")
    axes.xaxis.set_major_formatter(ScalarFormatter())
    low, high = axes.get_xlim()
    if high < 10.0 * low:
        axes.xaxis.set_minor_formatter(ScalarFormatter())
        axes.tick_params(axis="x", which="minor", labelsize=8)
    else:
        axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(visible=True, which="both", alpha=0.25)


def _title(reference: WideBaselineReference, found: BaselineComparison) -> str:
    figures = reference.figures
    rail_m = next(stop.rail_m for stop in figures.stops if stop.scan == figures.scan)
    return (
        f"from {1e3 * rail_m:.0f} mm on the rail: {found.samples} samples, "
        f"rig of {1e3 * figures.short_baseline_m:.0f} mm, "
        f"reference from {len(figures.stops)} stops (median {1e3 * figures.baseline_m:.0f} mm)"
    )
