"""Selects which foveae of a scan are matched with each other, and computes the depth of all pairs.

Verged on the scene's average depth, both foveae of a pair see only half of each view of a wall behind it; the
other half of the left view is seen by the right fovea of the next point. So a left fovea is matched with
every right one in its row whose gaze crosses it in front of the rig. What moved between the two contradicts
other pairs and is rejected.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass

from foveacam_hardware.contract import Role, Sighting, StereoVolts
from foveacam_pipeline.capture.mosaic.chart import Chart
from foveacam_pipeline.capture.mosaic.folder import MosaicFolder
from foveacam_pipeline.capture.mosaic.pair_depth import CellDepth, pair_cells
from foveacam_pipeline.capture.mosaic.values import MatchingFigures, MosaicSettings
from foveacam_pipeline.capture.mosaic.views import MosaicView
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.networks.estimator import NetworkEstimator
from foveacam_pipeline.networks.session import NetworkFault
from foveacam_pipeline.workers.progress import ProgressSteps

_log = logging.getLogger(__name__)
NEAREST_M, FARTHEST_M = 1.2, 40.0
"""Range of depths, m: gazes of different points that cross outside of it are not matched."""
ROW_SHARE = 0.2
"""Maximum difference in rows of two views that are matched, as a share of a view's height."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairDepths:
    """The depth of all pairs, and the method that computed it."""

    patches: list[CellDepth]
    matching: MatchingFigures


def pair_depths(
    views: Sequence[MosaicView],
    calibration: Calibration,
    chart: Chart,
    *,
    settings: MosaicSettings,
    steps: ProgressSteps,
    store: MosaicFolder,
) -> PairDepths:
    """Return the depth of all pairs. Raise Cancelled, OSError, or InvalidInput for an unsuitable network."""
    matcher = _PairMatcher(settings, calibration, chart)
    patches = []
    for view in views:
        for other in matching_partners(view, views, calibration):
            key = view.point.index, other.point.index
            cells = store.load_cells(key)
            if cells is None:
                cells = matcher.cells_of(view, other)
                store.save_cells(key, cells)
            if cells.per_depth.size:
                patches.append(cells)
        steps.step("depth of the pairs")
    return PairDepths(patches=patches, matching=matcher.figures)


class _PairMatcher:
    """Matches pairs with the network of the settings, or by semi-global matching where it fails."""

    def __init__(self, settings: MosaicSettings, calibration: Calibration, chart: Chart) -> None:
        self._settings, self._calibration, self._chart = settings, calibration, chart
        network = settings.network
        self._estimator = None if network is None else NetworkEstimator.open(network)
        self._failed = 0

    @property
    def figures(self) -> MatchingFigures:
        """The method that computed the pairs so far."""
        network = self._settings.network
        if network is None:
            return MatchingFigures()
        return MatchingFigures(backend=network.name, sha256=network.card.sha256, failed_pairs=self._failed)

    def cells_of(self, left: MosaicView, right: MosaicView) -> CellDepth:
        """Return the depth of the left fovea of one view and the right one of another."""
        sighting, eye = combined_look(left, right, self._settings), self._settings.eye
        if self._estimator is not None:
            try:
                return pair_cells(
                    sighting, self._calibration, self._chart, eye=eye, estimator=self._estimator
                )
            except NetworkFault as error:
                self._failed += 1
                _log.warning("points %d and %d: %s", left.point.index, right.point.index, error)
        return pair_cells(sighting, self._calibration, self._chart, eye=eye)


def matching_partners(
    view: MosaicView, views: Sequence[MosaicView], calibration: Calibration
) -> list[MosaicView]:
    """Return the views whose right fovea is matched with the left one of `view`, including itself."""
    return [other for other in views if other is view or _crosses(view, other, calibration)]


def combined_look(left: MosaicView, right: MosaicView, settings: MosaicSettings) -> Sighting:
    """Return the left fovea of one point and the right one of another as one look."""
    frame = left.point.stacked(Role.LEFT, bracket=settings.bracket)
    return Sighting(
        left=frame,
        right=right.point.stacked(Role.RIGHT, bracket=settings.bracket),
        wide=frame,
        volts=StereoVolts(left=left.volts.left, right=right.volts.right),
    )


def _crosses(left: MosaicView, right: MosaicView, calibration: Calibration) -> bool:
    f_b = calibration.fovea_f_px * calibration.baseline_m
    gazes = calibration.gaze_rad(StereoVolts(left=left.volts.left, right=right.volts.right))
    apart = [calibration.fovea_f_px * (a - b) for a, b in zip(*gazes, strict=True)]
    on_rows = abs(apart[1]) < ROW_SHARE * calibration.fovea_height
    return on_rows and f_b / FARTHEST_M < apart[0] < f_b / NEAREST_M
