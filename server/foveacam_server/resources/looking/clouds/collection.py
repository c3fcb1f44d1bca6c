"""Stores point clouds: one folder a cloud, written whole and then renamed, with a row in the database."""

import logging
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import String, select
from sqlalchemy.orm import Mapped, mapped_column

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.measure.look import LookDepth
from foveacam_pipeline.measure.look_file import save_look
from foveacam_pipeline.stereo.ply import VERTEX, ply_bytes
from foveacam_pipeline.stereo.values import Cloud, DepthMesh
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.names import new_id, utc_now
from foveacam_server.foundation.store import SchemaColumn, Store, TableRow
from foveacam_server.resources.looking.clouds.depth_patches import (
    MAX_PATCHES,
    DepthPatch,
    DepthPatches,
    load_patch,
    save_patch,
)
from foveacam_server.resources.looking.clouds.schema import CloudDocument
from foveacam_server.rig.encoder import encode_png
from foveacam_web.glb import write_glb

_log = logging.getLogger(__name__)

CLOUDS = "clouds"
ShapeFile: TypeAlias = Literal["cloud.ply", "mesh.glb", "depth.png"]
CloudFile: TypeAlias = ShapeFile | Literal["depth.npz"]

_FILES: tuple[ShapeFile, ...] = ("cloud.ply", "mesh.glb", "depth.png")
_FILES_WITHOUT_MESH: tuple[ShapeFile, ...] = ("cloud.ply", "depth.png")


class CloudRow(TableRow):
    """The point cloud of a fixation; its files are in the data directory under its id."""

    __tablename__ = "clouds"
    seq: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40), unique=True)
    fixation_id: Mapped[str] = mapped_column(index=True)
    document: Mapped[CloudDocument] = mapped_column(SchemaColumn(CloudDocument))


@dataclass(frozen=True, slots=True, kw_only=True)
class FixationShape:
    """Cloud, mesh and depth of one fixation; `depth_picture`: (h, w, 3) uint8 RGB."""

    fixation_id: str
    cloud: Cloud
    mesh: DepthMesh
    depth_picture: NDArray[np.uint8]
    backend: str
    network_sha256: str | None
    look_size: tuple[int, int]
    """Width and height of each fovea's frame, px, as its camera delivered it."""
    depth_size: tuple[int, int]
    """Width and height of the depth map, px."""
    patch: DepthPatch | None
    look: LookDepth | None = None


class CloudCollection:
    """Stores, lists and removes clouds; holds the newest depth patches."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._folder = store.subfolder(CLOUDS)
        self.patches = DepthPatches()
        for partial in self._folder.glob("*.part"):
            shutil.rmtree(partial, ignore_errors=True)  # left by an interrupted write: it has no row
        for cloud in reversed(self.newest(MAX_PATCHES)):
            path = self._folder / cloud.id / "patch.npz"
            if path.exists():
                self._add_stored_patch(path)

    def _add_stored_patch(self, path: Path) -> None:
        try:
            self.patches.add(load_patch(path))
        except (OSError, ValueError) as error:
            _log.warning("%s is skipped, its depth is unknown: %s", path, error)

    def put(self, shape: FixationShape) -> CloudDocument:
        """Write the files, then the row; on an error remove both."""
        cloud_id = new_id("cld")
        has_mesh = len(shape.mesh.faces) > 0
        cloud = _describe(cloud_id, shape, has_mesh=has_mesh)
        try:
            with disk_errors(f"the shape of fixation {shape.fixation_id}", self._folder):
                self._write(cloud_id, shape, has_mesh=has_mesh)
            with self._store.session() as session:
                session.add(CloudRow(id=cloud_id, fixation_id=shape.fixation_id, document=cloud))
        except FoveaError:
            shutil.rmtree(self._folder / f"{cloud_id}.part", ignore_errors=True)
            shutil.rmtree(self._folder / cloud_id, ignore_errors=True)
            raise
        if shape.patch is not None:
            self.patches.add(shape.patch)
        return cloud

    def _write(self, cloud_id: str, shape: FixationShape, *, has_mesh: bool) -> None:
        partial = self._folder / f"{cloud_id}.part"
        partial.mkdir()
        for name in _FILES if has_mesh else _FILES_WITHOUT_MESH:
            (partial / name).write_bytes(shape_content(shape, name))
        if shape.patch is not None:
            save_patch(shape.patch, partial / "patch.npz")
        if shape.look is not None:
            save_look(shape.look, partial / "depth.npz")
        partial.rename(self._folder / cloud_id)

    def get(self, cloud_id: str) -> CloudDocument:
        """Return a cloud by its id or raise `NotFound`."""
        with self._store.session() as session:
            row = session.scalars(select(CloudRow).where(CloudRow.id == cloud_id)).one_or_none()
        if row is None:
            raise NotFound(f"there is no cloud {cloud_id}; see /api/v1/clouds", asked=cloud_id)
        return row.document

    def of_fixation(self, fixation_id: str) -> CloudDocument | None:
        """Return the newest cloud of a fixation, None when it has none."""
        query = select(CloudRow).where(CloudRow.fixation_id == fixation_id).order_by(CloudRow.seq.desc())
        with self._store.session() as session:
            row = session.scalars(query.limit(1)).first()
        return None if row is None else row.document

    def newest(self, limit: int) -> list[CloudDocument]:
        """Return the newest clouds, newest first."""
        with self._store.session() as session:
            rows = session.scalars(select(CloudRow).order_by(CloudRow.seq.desc()).limit(limit))
            return [row.document for row in rows]

    def file(self, cloud_id: str, name: CloudFile) -> Path:
        """Return one file of a cloud or raise `NotFound`."""
        path = self._folder / self.get(cloud_id).id / name
        if not path.is_file():
            raise NotFound(f"cloud {cloud_id} has no {name}", asked=name, found="no such file")
        return path

    def points(self, cloud_id: str) -> Cloud:
        """Return the points of a cloud from its PLY file."""
        content = self.file(cloud_id, "cloud.ply").read_bytes()
        header, _, body = content.partition(b"end_header\n")
        if not header.startswith(b"ply\n"):
            raise InvalidInput(f"cloud {cloud_id}: its PLY file is damaged; look at the target again")
        vertices = np.frombuffer(body, dtype=VERTEX)
        return Cloud(
            points_rig_m=np.column_stack([vertices["x"], vertices["y"], vertices["z"]]),
            colors=np.column_stack([vertices["red"], vertices["green"], vertices["blue"]]),
            sigma_m=vertices["sigma"].copy(),
        )

    def remove(self, cloud_id: str) -> CloudDocument:
        """Remove a cloud and its files; return what it was."""
        cloud = self.get(cloud_id)
        with self._store.session() as session:
            for row in session.scalars(select(CloudRow).where(CloudRow.id == cloud_id)):
                session.delete(row)
        shutil.rmtree(self._folder / cloud_id, ignore_errors=True)
        self.patches.forget(cloud.fixation_id)
        return cloud


def shape_content(shape: FixationShape, name: ShapeFile) -> bytes:
    """Return the content of one file of a shape."""
    match name:
        case "cloud.ply":
            return ply_bytes(shape.cloud)
        case "mesh.glb":
            return write_glb(shape.mesh, y_up=True)
        case "depth.png":
            return encode_png(shape.depth_picture)


def _describe(cloud_id: str, shape: FixationShape, *, has_mesh: bool) -> CloudDocument:
    points_m = shape.cloud.points_rig_m
    x_m, y_m, z_m = (round(float(value), 5) for value in np.median(points_m, axis=0))
    url = f"/api/v1/clouds/{cloud_id}"
    return CloudDocument(
        id=cloud_id,
        fixation_id=shape.fixation_id,
        created_utc=utc_now(),
        points=len(shape.cloud),
        centre_rig_m=(x_m, y_m, z_m),
        z_min_m=round(float(points_m[:, 2].min()), 5),
        z_max_m=round(float(points_m[:, 2].max()), 5),
        sigma_median_m=round(float(np.median(shape.cloud.sigma_m)), 6),
        backend=shape.backend,
        network_sha256=shape.network_sha256,
        look_width=shape.look_size[0],
        look_height=shape.look_size[1],
        depth_width=shape.depth_size[0],
        depth_height=shape.depth_size[1],
        ply_url=f"{url}.ply",
        glb_url=f"{url}.glb" if has_mesh else None,
        depth_url=f"{url}/depth.png",
    )
