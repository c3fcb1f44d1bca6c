"""REST documents of mosaics: size, layers and their tiles, figures, files; and the viewpoint for 3D."""

from datetime import UTC, datetime
from typing import TypeAlias

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_server.datasets.collection import CAPTURES_URL, brackets_of
from foveacam_server.foundation.store import Document
from foveacam_server.resources.mosaics.collection import FORMS, StoredMosaic

PICTURE_TILE_PX = 512
NEAREST_SHARE = 0.8
"""Distance of the viewpoint, as a share of the nearest depth."""
FIT_WIDTHS = 1.5
"""Distance in field widths from which the whole field is visible."""
LIFT = 0.06
"""Offset of the viewpoint aside and above, per metre of distance; head-on a surface looks flat."""
Point: TypeAlias = tuple[float, float, float]


def mosaic_url(capture_id: str) -> str:
    """Return the URL of a capture's mosaic."""
    return f"{CAPTURES_URL}/{capture_id}/mosaic"


def made_document(capture_id: str, made: StoredMosaic, dataset: Dataset | None) -> Document:
    """Return a complete mosaic as a document."""
    recipe, figures, url = made.document["recipe"], made.document["figures"], mosaic_url(capture_id)
    settings, chart = recipe["settings"], recipe["chart"]
    has_mesh = (made.folder / "mesh.glb").is_file()
    return {
        "eye": settings["eye"],
        "scan": settings["scan"],
        "bracket": settings["bracket"],
        "made_utc": datetime.fromtimestamp(made.made_ns / 1e9, tz=UTC).isoformat(timespec="seconds"),
        "size_bytes": made.size_bytes,
        "width": chart["width"],
        "height": chart["height"],
        "f_px": chart["f_px"],
        "u0_px": chart["u0_px"],
        "v0_px": chart["v0_px"],
        "eye_rig_m": _eye_rig_m(dataset, Role(settings["eye"])),
        "layers": [
            _layer("picture", chart["width"], chart["height"], PICTURE_TILE_PX, made.version, url),
            _layer(
                "depth",
                made.depth["width"],
                made.depth["height"],
                made.depth["tile_px"],
                made.version,
                url,
            ),
        ],
        "cell_px": made.depth["cell_px"],
        "step_m": made.depth["step_m"],
        "near_m": made.depth["near_m"],
        "far_m": made.depth["far_m"],
        "views": figures["views"],
        "tiles": figures["tiles"],
        "seams": figures["seams"],
        "depth": figures["depth"],
        "overview_url": f"{url}/overview.png?made={made.version}",
        "depth_picture_url": f"{url}/depth.png?made={made.version}",
        "glb_url": f"{url}/mesh.glb?made={made.version}" if has_mesh else None,
        "ply_url": f"{url}/cloud.ply?made={made.version}" if has_mesh else None,
    }


def _layer(name: str, width: int, height: int, tile_px: int, version: str, url: str) -> Document:
    tiles = f"{url}/tiles/{name}_files/{{level}}/{{x}}_{{y}}.{FORMS[name]}?made={version}"
    return {
        "name": name,
        "width": width,
        "height": height,
        "levels": (max(width, height) - 1).bit_length() + 1,
        "tile_px": tile_px,
        "tiles_url": tiles,
        "dzi_url": f"{url}/tiles/{name}.dzi",
    }


def _eye_rig_m(dataset: Dataset | None, eye: Role) -> list[float] | None:
    if dataset is None or dataset.calibration is None:
        return None
    return [float(value) for value in dataset.calibration.reference_rig_m(eye)]


def choices_document(dataset: Dataset | None) -> Document:
    """Return the scans and exposures that a mosaic can be made of."""
    return {"scans": [] if dataset is None else list(dataset.scans), "brackets": brackets_of(dataset)}


def viewpoint_of(made: StoredMosaic) -> tuple[Point, Point]:
    """Return eye and target of a good view, m, rig frame: before the nearest depth, to the centre."""
    chart, near_m, far_m = made.document["recipe"]["chart"], made.depth["near_m"], made.depth["far_m"]
    if near_m is None:
        return (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)
    f_px, z_m = chart["f_px"], (near_m + far_m) / 2
    x, y = (chart["u0_px"] + chart["width"] / 2) / f_px, (chart["v0_px"] + chart["height"] / 2) / f_px
    across_m = chart["width"] / f_px * z_m
    eye_z_m = min(NEAREST_SHARE * near_m, z_m - FIT_WIDTHS * across_m)
    lift = LIFT * (z_m - eye_z_m)
    return (x * eye_z_m + lift, y * eye_z_m - lift, eye_z_m), (x * z_m, y * z_m, z_m)
