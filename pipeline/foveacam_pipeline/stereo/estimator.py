"""The interface of dense depth: backends, chosen by name, that compute the disparity map of a pair.

`sgbm` is the default; `live` is several times faster, for live views. A further backend is a class with the
members of `DepthEstimator`, added to `BACKENDS`.
"""

from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, Protocol, TypeAlias

from foveacam_pipeline.stereo.live import match_live
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.search import DEFAULT, MatchSettings
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

DepthBackend: TypeAlias = Literal["sgbm", "live"]


class DepthEstimator(Protocol):
    """Measures the disparity of every pixel of a pair's left window."""

    @property
    def name(self) -> str:
        """Name by which the backend is chosen."""
        ...

    def estimate(self, pair: RectifiedPair) -> DisparityMap:
        """Return signed residual disparity, its error, unknown pixels, and pixels hidden at right."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchedPair:
    """The disparities of a pair, and the backend that computed them."""

    disparity: DisparityMap
    backend: str
    sha256: str | None
    """SHA-256 of the network's graph; None for a built-in backend."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SemiGlobalEstimator:
    """Semi-global matching at full size."""

    settings: MatchSettings = DEFAULT
    name: str = "sgbm"

    def estimate(self, pair: RectifiedPair) -> DisparityMap:
        """Return the disparity map of a pair."""
        return match(pair, self.settings)


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveEstimator:
    """Semi-global matching at half the size, refined at full size."""

    settings: MatchSettings = DEFAULT
    name: str = "live"

    def estimate(self, pair: RectifiedPair) -> DisparityMap:
        """Return the disparity map of a pair."""
        return match_live(pair, self.settings)


BACKENDS: MappingProxyType[DepthBackend, DepthEstimator] = MappingProxyType(
    {"sgbm": SemiGlobalEstimator(), "live": LiveEstimator()}
)
