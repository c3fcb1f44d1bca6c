"""Correlation of many weighted patches with few rows of one picture.

Row spectra are computed once: those of a picture are shared by all patches, those of a patch by all pictures.
A few rows of a correlation map need no two-dimensional transform.
"""

from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.matching.survey import LEAST_SEEN, ReducedEye, ReducedLook

LEAST_SHARE = 1.0e-4
"""A window's variance below this share of its mean square is rounding error."""
LEAST_VARIANCE = 1.0e-3
"""Summed weighted variance of a window without any contrast, grey levels squared."""

Spectrum: TypeAlias = NDArray[np.complex64]


class PictureRows:
    """The spectra of the rows of one fovea at survey scale, and of their squares."""

    def __init__(self, eye: ReducedEye) -> None:
        self.u0_px, self.v0_px = eye.u0_px, eye.v0_px
        self.height, self.width = eye.image.shape
        self.length = cv2.getOptimalDFTSize(self.width)
        image = eye.image - np.float32(eye.image.mean())  # centred values lose less precision when squared
        self.plain: Spectrum = np.fft.rfft(image, self.length, axis=1).astype(np.complex64, copy=False)
        squares = np.fft.rfft(image * image, self.length, axis=1)
        self.squared: Spectrum = squares.astype(np.complex64, copy=False)
        self._seen = eye.seen
        self._covers: dict[int, NDArray[np.float32]] = {}

    def hidden(self, rows: slice, side: int) -> NDArray[np.bool_]:
        """Return (columns,) bool: which windows of width `side` reach past the frame in some of the rows."""
        if side not in self._covers:
            cover = cv2.blur(self._seen, (side, 1), borderType=cv2.BORDER_REPLICATE)
            self._covers[side] = np.asarray(cover, dtype=np.float32)
        half = side // 2
        covered = self._covers[side][rows, half : half + self.width - side + 1]
        return np.asarray(covered.min(axis=0) < LEAST_SEEN)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LookRows:
    """Row spectra of both foveae of one look."""

    left: PictureRows
    right: PictureRows

    @classmethod
    def of(cls, look: ReducedLook) -> "LookRows":
        """Compute the row spectra of both foveae."""
        return cls(left=PictureRows(look.left), right=PictureRows(look.right))


class WeightedPatch:
    """A patch, (h, w) float32, with a weight a pixel (h, w), for weighted normalised correlation."""

    def __init__(self, patch: NDArray[np.float32], weights: NDArray[np.float32]) -> None:
        self.height, self.width = patch.shape
        total = float(weights.sum())
        mean = float((weights * patch).sum()) / total if total else 0.0
        squared = weights * weights
        pattern = squared * (patch - np.float32(mean))
        self._energy = float((pattern * (patch - np.float32(mean))).sum())
        self._pattern_sum, self._total, self._square_sum = float(pattern.sum()), total, float(squared.sum())
        self._parts = np.stack([pattern, squared, weights])
        self._spectra: dict[int, Spectrum] = {}

    def scores(self, picture: PictureRows, rows: range) -> NDArray[np.float64]:
        """Return (columns,) the best correlation over some first rows, for each first column of a window.

        As OpenCV's `TM_CCOEFF_NORMED` with a mask: -1 to 1, 0 where a window or the patch has no contrast.
        """
        columns = picture.width - self.width + 1
        if self._total == 0.0:
            return np.zeros(columns)
        parts = self._spectrum(picture.length)
        products = np.empty((len(rows), 4, parts.shape[2]), dtype=np.complex64)
        for index, row in enumerate(rows):
            within = slice(row, row + self.height)
            (picture.plain[within] * parts).sum(axis=1, out=products[index, :3])
            (picture.squared[within] * parts[1]).sum(axis=0, out=products[index, 3])
        shifted = np.fft.irfft(products, picture.length, axis=2)[..., :columns]
        alike, plain, level, square = shifted.transpose(1, 0, 2)
        mean = level / np.float32(self._total)
        variance = square + mean * (mean * np.float32(self._square_sum) - 2.0 * plain)
        variance[variance <= LEAST_SHARE * square + LEAST_VARIANCE] = np.inf
        norm = np.sqrt(variance * np.float32(max(self._energy, LEAST_VARIANCE)))
        found = (alike - mean * np.float32(self._pattern_sum)) / norm
        return np.asarray(found.max(axis=0), dtype=np.float64)

    def _spectrum(self, length: int) -> Spectrum:
        """Return (3, h, length // 2 + 1) conjugate spectra: pattern, squared weights, weights."""
        if length not in self._spectra:
            spectra = np.fft.rfft(self._parts, length, axis=2)
            self._spectra[length] = np.conj(spectra).astype(np.complex64, copy=False)
        return self._spectra[length]
