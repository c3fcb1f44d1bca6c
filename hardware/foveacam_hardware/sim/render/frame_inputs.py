"""The inputs of the kernels for one frame: the projection, the objects as it sees them, materials and sky."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.binning import TileBins
from foveacam_hardware.sim.render.materials import LUMA
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.render.scene import SceneSnapshot
from foveacam_hardware.sim.render.setup import KernelView, ObjectTable, VisibleFaces
from foveacam_hardware.sim.render.tiles import TileInputs

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
NEAR_M = 0.02
"""Nothing nearer to the projection centre is drawn."""


def kernel_view(projection: Projection, shift: F32, tile_shift: F64) -> KernelView:
    """Return a projection as the kernels use it; `shift`, `tile_shift`: as in `KernelView`."""
    Minv: F64 = np.asarray(np.linalg.inv(projection.M), dtype=np.float64)
    return KernelView(
        projection.M.copy(),  # writable, as all the others: kernels are compiled for either
        Minv,
        projection.C.copy(),
        np.asarray(projection.axis @ Minv, dtype=np.float64),
        1.0 / (NEAR_M * float(np.linalg.norm(projection.M[2]))),
        projection.width,
        projection.height,
        shift,
        tile_shift,
    )


def object_table(snapshot: SceneSnapshot, projection: Projection, view: KernelView) -> ObjectTable:
    """Return the transforms of all objects in a view."""
    R, T = snapshot.poses[:, :3, :3], snapshot.poses[:, :3, 3]
    away = T - projection.C
    return ObjectTable(
        np.einsum("nji,jk->nik", R, view.Minv),
        -np.einsum("nji,nj->ni", R, away),
        np.einsum("nji,j->ni", R, snapshot.lamp),
        np.einsum("ij,njk->nik", projection.M, R),
        np.einsum("ij,nj->ni", projection.M, away),
    )


def tile_inputs(
    snapshot: SceneSnapshot,
    view: KernelView,
    objects: ObjectTable,
    prims: VisibleFaces,
    bins: TileBins,
    *,
    channels: int,
    cut_px: float,
) -> TileInputs:
    """Return the inputs of all tiles of a frame; `cut_px`: shortest wavelength of noise that is drawn."""
    colors, sky = _in_channels(snapshot, channels)
    tables = snapshot.tables._replace(colors=colors)
    return TileInputs(view, objects, prims, bins, tables, snapshot.geometry.smooth, sky, LUMA, cut_px)


def _in_channels(snapshot: SceneSnapshot, channels: int) -> tuple[F64, F64]:
    """Return the colours (n, 2, c) and the sky (2, c) in the frame's channels; coverage has no colour."""
    if channels >= 3:
        return snapshot.tables.colors, snapshot.sky
    return (snapshot.tables.colors @ LUMA)[..., None], (snapshot.sky @ LUMA)[..., None]
