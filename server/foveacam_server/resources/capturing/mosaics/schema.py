"""Schemas of mosaics."""

from typing import Literal

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.mosaic.values import MosaicSettings
from foveacam_server.foundation.quantities import Bracket, Index
from foveacam_server.foundation.schema import JobProgress, Problem, RequestModel, ResponseModel

Eye = Literal["left", "right"]
State = Literal["none", "unfinished", "building", "complete"]


class MosaicRequest(RequestModel):
    """Eye, scan and exposure of the dataset of which the mosaic is made."""

    eye: Eye = "left"
    scan: Index = 0
    bracket: Bracket = 0

    def settings(self) -> MosaicSettings:
        """Return the pipeline's settings for this request."""
        return MosaicSettings(eye=Role(self.eye), scan=self.scan, bracket=self.bracket)


class MosaicNeedsDocument(ResponseModel):
    """Estimated size of a mosaic: views, px, disk space."""

    views: int
    width: int
    height: int
    needed_bytes: int
    free_bytes: int


class MosaicLayer(ResponseModel):
    """One layer as Deep Zoom: level 0 is one pixel, the last level the full size."""

    name: Literal["picture", "depth"]
    width: int
    height: int
    levels: int
    tile_px: int
    tiles_url: str
    dzi_url: str


class MosaicSeams(ResponseModel):
    """Seams: distances between corresponding points of overlapping views, fovea px."""

    links: int
    rejected: int
    before_rms_px: float | None
    after_rms_px: float | None
    measuring_rms_px: float | None
    adjusted: bool
    largest_shift_px: float | None
    largest_gain_percent: float | None


class MosaicDepth(ResponseModel):
    """Figures of the fused depth; shares from 0 to 1."""

    known: float
    seen_twice: float
    between_pairs_rel_rms: float | None
    outliers: float
    median_sigma_rel: float | None


class MosaicMatching(ResponseModel):
    """Backend that computed the depth of the pairs."""

    backend: str = "sgbm"
    sha256: str | None = None
    """SHA-256 of the network's graph; null where the backend is not a network."""
    failed_pairs: int = 0
    """Number of pairs on which the network failed and semi-global matching was used."""


class MadeMosaic(ResponseModel):
    """A finished mosaic.

    Pixel (x, y) is the direction ((x + u0_px) / f_px, (y + v0_px) / f_px, 1) from the eye at `eye_rig_m`.
    A pixel of the depth layer is `cell_px` of the picture; red * 65536 + green * 256 + blue of it, times
    `step_m`, is its depth along z; black is unknown.
    """

    eye: Eye
    scan: int
    bracket: int
    made_utc: str
    size_bytes: int
    width: int
    height: int
    f_px: float
    u0_px: int
    v0_px: int
    eye_rig_m: tuple[float, float, float] | None
    layers: list[MosaicLayer]
    cell_px: int
    step_m: float
    near_m: float | None
    far_m: float | None
    views: int
    tiles: int
    seams: MosaicSeams
    depth: MosaicDepth
    matching: MosaicMatching
    overview_url: str
    depth_picture_url: str
    glb_url: str | None
    ply_url: str | None


class MosaicDocument(ResponseModel):
    """The state of a capture's mosaic, and the estimated size of one or why none is possible.

    `outdated`: points were added to the capture since. `in_scene`: its surface is in the 3D scene.
    """

    capture_id: str
    name: str
    state: State
    outdated: bool
    job_id: str | None
    progress: JobProgress | None
    needs: MosaicNeedsDocument | None
    refusal: Problem | None
    scans: list[int]
    brackets: list[int]
    in_scene: bool
    made: MadeMosaic | None
    url: str
