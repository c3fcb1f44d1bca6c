"""Exports measurements as a table of comma-separated values, with units in the columns' names."""

import csv
import io
from collections.abc import Sequence

from foveacam_server.resources.looking.measurements.schema import MeasurementDocument

Cell = str | float | int | None
COLUMNS = (
    "id",
    "kind",
    "label",
    "created_utc",
    "fixation_ids",
    "x_m",
    "y_m",
    "z_m",
    "x_sigma_m",
    "y_sigma_m",
    "z_sigma_m",
    "distance_m",
    "distance_sigma_m",
    "to_x_m",
    "to_y_m",
    "to_z_m",
    "length_m",
    "length_sigma_m",
    "normal_x",
    "normal_y",
    "normal_z",
    "normal_sigma_deg",
    "pan_deg",
    "pan_sigma_deg",
    "tilt_deg",
    "tilt_sigma_deg",
    "residual_rms_m",
    "flatness_m",
    "pixels",
    "outliers",
    "profile_length_m",
    "profile_median_z_m",
    "profile_shared_sigma_m",
    "profile_known_fraction",
)
FORMULAS = ("=", "+", "-", "@", "\t")
"""First characters at which a spreadsheet takes a cell for a formula; a label must not be run as one."""


def csv_text(documents: Sequence[MeasurementDocument]) -> str:
    """Return all measurements as CSV (RFC 4180); cells that a kind does not have are empty."""
    file = io.StringIO()
    writer = csv.DictWriter(file, fieldnames=COLUMNS, restval="")
    writer.writeheader()
    for document in documents:
        writer.writerow({name: "" if cell is None else cell for name, cell in _cells(document).items()})
    return file.getvalue()


def _cells(document: MeasurementDocument) -> dict[str, Cell]:
    label = f"'{document.label}" if document.label.startswith(FORMULAS) else document.label
    cells: dict[str, Cell] = {
        "id": document.id,
        "kind": document.kind,
        "label": label,
        "created_utc": document.created_utc,
        "fixation_ids": " ".join(document.fixation_ids),
    }
    return cells | _point(document) | _length(document) | _plane(document) | _profile(document)


def _point(document: MeasurementDocument) -> dict[str, Cell]:
    if not document.points:
        return {}
    point = document.points[0]
    axes = ("x", "y", "z")
    cells: dict[str, Cell] = {f"{a}_m": value for a, value in zip(axes, point.point_rig_m, strict=True)}
    cells |= {f"{a}_sigma_m": value for a, value in zip(axes, point.point_sigma_m, strict=True)}
    return cells | {"distance_m": point.distance_m, "distance_sigma_m": point.distance_sigma_m}


def _length(document: MeasurementDocument) -> dict[str, Cell]:
    if document.length is None:
        return {}
    to_x_m, to_y_m, to_z_m = document.points[1].point_rig_m
    return {
        "to_x_m": to_x_m,
        "to_y_m": to_y_m,
        "to_z_m": to_z_m,
        "length_m": document.length.length_m,
        "length_sigma_m": document.length.length_sigma_m,
    }


def _plane(document: MeasurementDocument) -> dict[str, Cell]:
    plane = document.plane
    if plane is None:
        return {}
    cells: dict[str, Cell] = {
        name: value
        for name, value in plane.model_dump(mode="json").items()
        if name in COLUMNS and isinstance(value, (float, int))
    }
    x, y, z = plane.normal
    x_m, y_m, z_m = plane.centre_rig_m
    return cells | {"normal_x": x, "normal_y": y, "normal_z": z, "x_m": x_m, "y_m": y_m, "z_m": z_m}


def _profile(document: MeasurementDocument) -> dict[str, Cell]:
    profile = document.profile
    if profile is None:
        return {}
    return {
        "profile_length_m": profile.samples[-1].along_m,
        "profile_median_z_m": profile.median_z_m,
        "profile_shared_sigma_m": profile.shared_sigma_m,
        "profile_known_fraction": profile.known_fraction,
    }
