"""Export to a COLMAP text model: cameras.txt, images.txt, points3D.txt, and their images.

COLMAP's first pixel has its centre at (0.5, 0.5); its poses are camera_from_world.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.dataset.export.target import ExportChoice, write_png
from foveacam_pipeline.capture.dataset.export.views import (
    ExportPinhole,
    ExportView,
    Matrix,
    Seeds,
    fovea_camera,
    fovea_views,
    pose_calibration,
    seeds_of,
    wide_view,
)
from foveacam_pipeline.capture.dataset.reader import Dataset

FOVEA, WIDE = 1, 2
"""COLMAP ids of the two cameras."""
MODEL = Path("sparse") / "0"


@dataclass(slots=True)
class _ColmapModel:
    """The lines of images.txt and points3D.txt, collected view by view."""

    images: list[str] = field(default_factory=list)
    points: list[str] = field(default_factory=list)
    count: int = 0

    def add_view(self, view: ExportView, seen: NDArray[np.float64], first: int) -> None:
        """Add one image and its pixels, (n, 2), of the points numbered from `first`."""
        self.count += 1
        pose = " ".join(f"{value:.17g}" for value in camera_from_world(view.world_from_camera))
        camera = WIDE if view.name.startswith("wide/") else FOVEA
        self.images.append(f"{self.count} {pose} {camera} {view.name}")
        self.images.append(
            " ".join(f"{x + 0.5:.4f} {y + 0.5:.4f} {first + n}" for n, (x, y) in enumerate(seen.tolist()))
        )

    def add_points(self, seeds: Seeds, images: tuple[int, int]) -> None:
        """Add points that both `images` see; the n-th point is the n-th pixel of each."""
        for n, (place, colour) in enumerate(zip(seeds.points_world_m, seeds.colors, strict=True)):
            x, y, z = place.tolist()
            red, green, blue = colour.tolist()
            track = f"{images[0]} {n} {images[1]} {n}"
            number = len(self.points) + 1
            self.points.append(f"{number} {x:.9g} {y:.9g} {z:.9g} {red} {green} {blue} 0 {track}")


def export_colmap(dataset: Dataset, folder: Path, choice: ExportChoice) -> None:
    """Write images/ and sparse/0/ into an empty folder."""
    calibration = pose_calibration(dataset)
    model, scans = _ColmapModel(), set()
    wide_camera: ExportPinhole | None = None
    for point in dataset:
        seeds = seeds_of(point, max_points=choice.seeds_per_pair)
        first = len(model.points) + 1
        for view in fovea_views(point, calibration, scale=choice.scale):
            write_png(folder / "images" / view.name, view.image)
            model.add_view(view, view.pixels(seeds.points_world_m), first)
        model.add_points(seeds, (model.count - 1, model.count))
        if point.place.scan not in scans and any(frame.role == "wide" for frame in point.frames):
            view = wide_view(point, calibration)
            write_png(folder / "images" / view.name, view.image)
            model.add_view(view, np.empty((0, 2)), 0)
            wide_camera = view.camera
        scans.add(point.place.scan)
        choice.report_point(point.index)
    cameras = [_camera_line(FOVEA, fovea_camera(calibration, scale=choice.scale))]
    if wide_camera is not None:
        cameras.append(_camera_line(WIDE, wide_camera))
    (folder / MODEL).mkdir(parents=True)
    _write_lines(folder / MODEL / "cameras.txt", "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]", cameras)
    _write_lines(
        folder / MODEL / "images.txt",
        "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME / POINTS2D[] as X Y POINT3D_ID",
        model.images,
    )
    _write_lines(folder / MODEL / "points3D.txt", "POINT3D_ID X Y Z R G B ERROR TRACK[]", model.points)


def camera_from_world(world_from_camera: Matrix) -> tuple[float, ...]:
    """Return the quaternion (w, x, y, z) and the translation of the inverse of a pose."""
    rotation = world_from_camera[:3, :3].T
    translation = -rotation @ world_from_camera[:3, 3]
    axis = cv2.Rodrigues(rotation)[0].ravel()
    angle = float(np.linalg.norm(axis))
    vector = axis * (np.sin(angle / 2) / angle if angle > 0.0 else 0.5)
    return (float(np.cos(angle / 2)), *vector.tolist(), *translation.tolist())


def _camera_line(number: int, camera: ExportPinhole) -> str:
    place = f"{camera.cx_px + 0.5:.17g} {camera.cy_px + 0.5:.17g}"
    return f"{number} PINHOLE {camera.width} {camera.height} {camera.f_px:.17g} {camera.f_px:.17g} {place}"


def _write_lines(path: Path, title: str, lines: Iterable[str]) -> None:
    path.write_text("\n".join([f"# {title}", *lines]) + "\n", encoding="utf-8")
