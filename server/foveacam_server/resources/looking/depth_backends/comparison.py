"""Compares two backends on the newest look; the last comparisons with their pictures are held in memory."""

import threading
from collections import OrderedDict
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.comparison import compare_disparities, difference_picture
from foveacam_pipeline.stereo.depth import depth_map
from foveacam_pipeline.stereo.estimator import DepthEstimator
from foveacam_pipeline.stereo.pictures import depth_picture, depth_span
from foveacam_pipeline.stereo.values import DepthMap, DisparityMap, RectifiedPair
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.names import new_id
from foveacam_server.resources.looking.depth_backends.schema import (
    BackendComparisonDocument,
    BackendComparisonRequest,
    ComparedBackend,
)
from foveacam_server.resources.looking.depth_backends.service import DepthBackendService
from foveacam_server.rig.encoder import encode_png

PictureName: TypeAlias = Literal["first", "second", "difference", "left"]
URL = "/api/v1/depth/comparisons"
KEPT = 4
SPREADS = 3.0
LEAST_LIMIT_PX = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class PicturedComparison:
    """A comparison with its pictures, PNG."""

    document: BackendComparisonDocument
    pictures: dict[PictureName, bytes]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Side:
    name: str
    sha256: str | None
    disparity: DisparityMap
    depth: DepthMap


class BackendComparisons:
    """Compares depth backends; callable from any thread. `compare` blocks while both backends compute."""

    def __init__(self, backends: DepthBackendService) -> None:
        self._backends = backends
        self._changing = threading.Lock()
        self._kept: OrderedDict[str, PicturedComparison] = OrderedDict()

    def compare(self, request: BackendComparisonRequest) -> BackendComparisonDocument:
        """Return the difference of two backends on the newest look.

        Raise InvalidInput without a look or for the same backend twice, NotFound for an unknown backend; a
        failing network raises its own error.
        """
        if request.first == request.second:
            raise InvalidInput(
                f"{request.first} is to be compared with itself",
                asked=request.first,
                remedy="choose two different backends",
            )
        pair = self._backends.last_pair
        if pair is None:
            raise InvalidInput(
                "nothing was looked at since the server started",
                found="no look",
                remedy="click something, then compare",
            )
        first, second = (
            _matched(pair, name, *self._backends.open(name, research_confirmed=request.research_confirmed))
            for name in (request.first, request.second)
        )
        found = _comparison(pair, first, second)
        with self._changing:
            self._kept[found.document.id] = found
            while len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        return found.document

    def picture(self, comparison_id: str, name: PictureName) -> bytes:
        """Return a picture of a comparison; raise NotFound when the comparison is no longer held."""
        with self._changing:
            found = self._kept.get(comparison_id)
        if found is None:
            raise NotFound(
                f"there is no comparison {comparison_id}: the last {KEPT} are kept",
                asked=comparison_id,
                remedy="compare again",
            )
        return found.pictures[name]


def _matched(pair: RectifiedPair, name: str, estimator: DepthEstimator, sha256: str | None) -> _Side:
    disparity = estimator.estimate(pair)
    return _Side(name=name, sha256=sha256, disparity=disparity, depth=depth_map(pair, disparity))


def _comparison(pair: RectifiedPair, first: _Side, second: _Side) -> PicturedComparison:
    found = compare_disparities(first.disparity, second.disparity)
    comparison_id = new_id("cmp")
    limit_px = max(LEAST_LIMIT_PX, SPREADS * (found.spread_px or 0.0) + abs(found.median_px or 0.0))
    near_m, far_m = depth_span(np.stack([first.depth.z_m, second.depth.z_m]))
    address = f"{URL}/{comparison_id}"
    document = BackendComparisonDocument(
        id=comparison_id,
        first=_side_document(first, known=found.known_first, picture_url=f"{address}/first.png"),
        second=_side_document(second, known=found.known_second, picture_url=f"{address}/second.png"),
        known_both=round(found.known_both, 4),
        median_px=_rounded(found.median_px),
        spread_px=_rounded(found.spread_px),
        within_1=_rounded(found.within_1),
        within_2=_rounded(found.within_2),
        edges=[round(edge, 6) for edge in found.edges.tolist()],
        shares=[round(share, 6) for share in found.shares.tolist()],
        limit_px=round(limit_px, 3),
        difference_url=f"{address}/difference.png",
        left_url=f"{address}/left.png",
    )
    return PicturedComparison(
        document=document,
        pictures={
            "first": encode_png(depth_picture(first.depth, near_m=near_m, far_m=far_m)),
            "second": encode_png(depth_picture(second.depth, near_m=near_m, far_m=far_m)),
            "difference": encode_png(difference_picture(found, limit_px=limit_px)),
            "left": encode_png(_rgb(pair.left)),
        },
    )


def _side_document(side: _Side, *, known: float, picture_url: str) -> ComparedBackend:
    sigma_px = side.disparity.sigma_px[np.isfinite(side.disparity.sigma_px)]
    return ComparedBackend(
        name=side.name,
        sha256=side.sha256,
        known=round(known, 4),
        compute_ms=round(side.disparity.compute_ms, 1),
        sigma_median_px=_rounded(float(np.median(sigma_px))) if sigma_px.size else None,
        picture_url=picture_url,
    )


def _rgb(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.repeat(picture[..., None], 3, axis=2) if picture.ndim == 2 else picture


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 4)
