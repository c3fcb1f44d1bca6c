"""Fuse several disparity maps of one gaze on a static target.

The noise of the looks is independent; the errors of the matcher by texture, slant and edges, and the pose
error, are common to all of them. Only the noise decreases with the number of looks.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.refine import FloatImage
from foveacam_pipeline.stereo.values import DisparityMap

OUTLIER_SIGMA = 3.0
"""A map is left out at a pixel where it lies more standard errors than this from the median of all maps."""
LEAST_SHARE = 0.5
"""Least share of the maps that must have a pixel and agree on it."""
SMALLEST_SCATTER_SHARE = 0.1
"""Least share of noise in a stated error: the scatter of few looks is a poor estimate."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DisparityStack:
    """Disparity maps of one gaze (immutable)."""

    maps: tuple[DisparityMap, ...] = ()

    def with_map(self, disparity: DisparityMap) -> "DisparityStack":
        """Return a new stack with one more map of the same size."""
        if self.maps and disparity.residual_px.shape != self.maps[0].residual_px.shape:
            raise InvalidInput(
                f"a disparity map of {disparity.residual_px.shape} px cannot be added to maps of "
                f"{self.maps[0].residual_px.shape} px; begin a new stack when the window changes"
            )
        return DisparityStack(maps=(*self.maps, disparity))

    def fused(self) -> DisparityMap:
        """Return the mean weighted by 1 / sigma^2 without outliers, and its error."""
        if not self.maps:
            raise InvalidInput("no disparity map to fuse; add at least one")
        values = np.stack([each.residual_px for each in self.maps])
        sigmas = np.stack([each.sigma_px for each in self.maps])
        known = np.isfinite(values)
        centre = _median(values, known)
        known &= np.abs(np.nan_to_num(values) - centre) <= OUTLIER_SIGMA * np.nan_to_num(sigmas)
        weight = np.where(known, 1.0 / np.square(np.nan_to_num(sigmas, nan=1.0)), 0.0).astype(np.float32)
        count, total = known.sum(axis=0), weight.sum(axis=0)
        enough = count >= max(1.0, LEAST_SHARE * len(self.maps))
        safe_total = np.where(enough, total, np.float32(1.0))
        mean = (weight * np.nan_to_num(values)).sum(axis=0) / safe_total
        sigma = _fused_sigma(values, sigmas, known, np.asarray(mean, dtype=np.float32))
        return DisparityMap(
            residual_px=np.where(enough, mean, np.nan).astype(np.float32),
            sigma_px=np.where(enough, sigma, np.nan).astype(np.float32),
            compute_ms=sum(each.compute_ms for each in self.maps),
            occluded=self._occluded(),
            wrong=self._wrong(known),
        )

    def _wrong(self, known: NDArray[np.bool_]) -> FloatImage | None:
        """Return the mean probability of the maps that count; None unless all maps have one.

        Looks at one target share what makes a match wrong, so that several are wrong together.
        """
        found = [each.wrong for each in self.maps if each.wrong is not None]
        if len(found) < len(self.maps):
            return None
        count = known.sum(axis=0)
        total = np.where(known, np.nan_to_num(np.stack(found)), 0.0).sum(axis=0)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan).astype(np.float32)

    def _occluded(self) -> NDArray[np.bool_] | None:
        """Return the pixels that most maps mark as hidden from the right eye."""
        found = [each.occluded for each in self.maps if each.occluded is not None]
        return np.mean(found, axis=0) > LEAST_SHARE if found else None


def _median(values: FloatImage, known: NDArray[np.bool_]) -> FloatImage:
    """Return (h, w) the median over the known values of (n, h, w); 0 where none is known."""
    ordered = np.sort(np.where(known, values, np.inf), axis=0)
    count = known.sum(axis=0)[None]
    low, high = (
        np.take_along_axis(ordered, np.maximum(i, 0), axis=0) for i in ((count - 1) // 2, count // 2)
    )
    middle = np.where(count > 0, np.where(np.isfinite(high), high, low) + low, 0.0)[0] / 2
    return np.asarray(middle, dtype=np.float32)


def _fused_sigma(
    values: FloatImage, sigmas: FloatImage, known: NDArray[np.bool_], mean: FloatImage
) -> FloatImage:
    """Return (h, w) the standard error of the mean.

    Stated variance = scatter between maps, which averaging reduces, + a part that all looks share.
    """
    count = np.maximum(known.sum(axis=0), 1)
    stated = np.where(known, np.square(np.nan_to_num(sigmas)), 0.0).sum(axis=0) / count
    off = np.where(known, np.square(np.nan_to_num(values) - mean), 0.0).sum(axis=0)
    scatter = np.where(count > 1, off / np.maximum(count - 1, 1), stated)
    scatter = np.clip(scatter, SMALLEST_SCATTER_SHARE**2 * stated, stated)
    return np.asarray(np.sqrt(stated - scatter + scatter / count), dtype=np.float32)
