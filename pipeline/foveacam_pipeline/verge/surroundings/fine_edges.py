"""The depth of a border's edges by left against right, at the resolution of the foveae.

Against the wide view an edge is placed to half a survey px in either fovea, and what shows beyond it pulls
the two edges of a surface apart. Left against right is several times as accurate, once both eyes look there.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import aim_at
from foveacam_pipeline.verge.looking.fixation_head import Observation
from foveacam_pipeline.verge.matching.fine import SUPPORTED_PX, MatchGuess, match_fine
from foveacam_pipeline.verge.surroundings.border_depth import BorderDepth

LEAST_SCORE = 0.8
MOST_SIGMA_PX = 1.6
"""Largest standard error of a match by its noise, fovea px."""
EDGE_SIGMA_PX = 2.0
"""Error of the disparity of an edge besides that by noise, fovea px: what lies beyond it is in the window too
(2.1 px rms of 8 edges of the plain card)."""
SAME_SIGMAS = 6.0
"""Largest change, in standard errors of the depth against the wide view."""


class FineEdges:
    """Looks at edges, and the depths of the edges that both foveae show there."""

    def __init__(self, calibration: Calibration) -> None:
        self._calibration = calibration
        self._looks: list[Observation] = []
        self._known: dict[tuple[BorderDepth, int], BorderDepth] = {}
        """Edges that were measured, by the edge against the wide view and the time of the look."""

    def add(self, observation: Observation) -> None:
        """Add a look at an edge."""
        self._looks.append(observation)

    def shown(self, edge: BorderDepth) -> bool:
        """Return whether a look shows an edge to both eyes."""
        return self._best_look(edge) is not None

    def measured(self, edges: Sequence[BorderDepth]) -> list[BorderDepth]:
        """Return the edges, with a better depth and error where left and right match."""
        return [self._measured(edge) for edge in edges]

    def _measured(self, edge: BorderDepth) -> BorderDepth:
        best = self._best_look(edge)
        if best is None:
            return edge
        observation, left, right = best
        key = edge, observation.sighting.left.t_ns
        if key not in self._known:
            self._known[key] = self._matched(edge, observation, left, right)
        return self._known[key]

    def _matched(
        self,
        edge: BorderDepth,
        observation: Observation,
        left: NDArray[np.float64],
        right: NDArray[np.float64],
    ) -> BorderDepth:
        """Return the edge as left against right measure it in a look, at (2,) tangents from each gaze."""
        fine = match_fine(observation.sighting, self._calibration, MatchGuess(left=left, right=right))
        if fine.score < LEAST_SCORE or fine.sigma_x_px > MOST_SIGMA_PX:
            return edge
        px_per_q = self._calibration.fovea_f_px * self._calibration.baseline_m
        moved = fine.residual_x_px / px_per_q - float(left[0] - right[0]) / self._calibration.baseline_m
        if abs(moved) > SAME_SIGMAS * edge.sigma_per_m:
            return edge
        inverse_z = edge.inverse_z_per_m + moved
        posed_px = self._calibration.pose_sigma_px(1.0 / inverse_z)
        sigma_px = math.hypot(fine.sigma_x_px, EDGE_SIGMA_PX, posed_px)
        return replace(edge, inverse_z_per_m=inverse_z, sigma_per_m=sigma_px / px_per_q)

    def _best_look(
        self, edge: BorderDepth
    ) -> tuple[Observation, NDArray[np.float64], NDArray[np.float64]] | None:
        """Return the look that shows an edge nearest to both image centres; and where, (2,) tangents each."""
        gazes = aim_at(self._calibration, np.array(edge.tangents), edge.inverse_z_per_m)
        sides_px = np.array([self._calibration.fovea_width, self._calibration.fovea_height])
        most = (sides_px / 2.0 - SUPPORTED_PX) / self._calibration.fovea_f_px
        found = None
        for observation in self._looks:
            left, right = gazes.left - observation.gazes.left, gazes.right - observation.gazes.right
            share = float(max(np.abs(left / most).max(), np.abs(right / most).max()))
            if share <= 1.0 and (found is None or share < found[0]):
                found = share, (observation, left, right)
        return None if found is None else found[1]
