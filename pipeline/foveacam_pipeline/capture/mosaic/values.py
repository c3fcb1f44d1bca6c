"""The settings of a mosaic, and the figures that report its quality."""

from dataclasses import dataclass

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.networks.card import StereoNetwork


@dataclass(frozen=True, slots=True, kw_only=True)
class MosaicSettings:
    """Settings of a mosaic. `eye`: whose views; `scan` and `bracket` of the dataset; `quality`: of the JPEGs.

    `adjust`: whether to shift, turn and scale views by the offsets in their overlaps. `network`: computes the
    depth of pairs; None: semi-global matching does.
    """

    scan: int = 0
    eye: Role = Role.LEFT
    bracket: int = 0
    quality: int = 90
    adjust: bool = True
    cloud_points: int = 300_000
    network: StereoNetwork | None = None

    def __post_init__(self) -> None:
        """Refuse invalid settings."""
        if self.eye is Role.WIDE:
            raise InvalidInput("a mosaic is made of foveae: ask for the left or the right eye")
        if not 1 <= self.quality <= 100:
            raise InvalidInput(f"JPEG quality {self.quality}: choose 1 to 100")
        if self.cloud_points < 1:
            raise InvalidInput(f"a cloud of {self.cloud_points} points: at least 1 is needed")


@dataclass(frozen=True, slots=True, kw_only=True)
class SeamFigures:
    """Distance between corresponding points of overlapping views, fovea px, rms.

    Measured on points held out of the adjustment. `links`: number of correspondences; `rejected`: points
    where the two pictures did not match. `adjusted`: whether the adjustment was larger than its own error
    and applied.
    """

    links: int
    rejected: int
    before_rms_px: float
    after_rms_px: float
    measuring_rms_px: float
    adjusted: bool
    largest_shift_px: float
    largest_gain_percent: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthFigures:
    """The fused depth. `known`: share of cells with depth; `seen_twice`: of those, by two pairs or more.

    `between_pairs_rel_rms`: difference of pairs in the same cell, relative; `outliers`: share of estimates
    that contradict the rest and were left out. `median_sigma_rel`: stated standard error over depth.
    """

    known: float
    seen_twice: float
    between_pairs_rel_rms: float
    outliers: float
    median_sigma_rel: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchingFigures:
    """The method that computed the depth of the pairs; `sha256`: of a network's graph.

    `failed_pairs`: of the pairs computed last, the number that fell back to semi-global matching.
    """

    backend: str = "sgbm"
    sha256: str | None = None
    failed_pairs: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class MosaicFigures:
    """A finished mosaic: size in px, number of foveae and tiles, and quality."""

    width: int
    height: int
    views: int
    tiles: int
    seams: SeamFigures
    depth: DepthFigures
    matching: MatchingFigures = MatchingFigures()
