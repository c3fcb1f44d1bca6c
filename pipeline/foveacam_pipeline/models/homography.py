"""The rectifying homography of one fovea as a smooth function of its gaze (Eq. 4).

Every entry is a polynomial of (ax, ay). The image centre is the gaze itself, so it maps to (0, 0) by
construction: the entries are fitted in pixels relative to the image centre.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract import Binning
from foveacam_pipeline.geometry.polynomial import BivariatePolynomial

ENTRIES = 6
"""Free entries about the image centre: four linear ones and the two of perspective."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HomographyField:
    """Rectifying homographies over the field of one mirror.

    `polynomial`: (ax, ay) rad -> (n, 6) entries a, b, c, d, e, f of [[a, b, 0], [c, d, 0], [e, f, 1]] on
    coordinates (pixel - centre) / `scale_px`. `loo_px`: root mean square leave-one-out distance, px.
    """

    polynomial: BivariatePolynomial
    centre_px: tuple[float, float]
    scale_px: float
    loo_px: float

    def binned(self, binning: Binning) -> "HomographyField":
        """Return the field for pixels of binned pictures, onto planes of an equally shorter focal length."""
        return self if binning == 1 else self.scaled(1.0 / binning)

    def scaled(self, scale: float) -> "HomographyField":
        """Return the field of a camera with `scale` times as many pixels a side: 2 undoes `binned(2)`."""
        x_px, y_px = self.centre_px
        return replace(
            self,
            centre_px=((x_px + 0.5) * scale - 0.5, (y_px + 0.5) * scale - 0.5),
            scale_px=self.scale_px * scale,
            loo_px=self.loo_px * scale,
        )

    def at(self, ax_rad: float, ay_rad: float) -> NDArray[np.float64]:
        """Return the (3, 3) float64 homography of a gaze, its last entry 1 (as `at_each`)."""
        homography: NDArray[np.float64] = self.at_each([[ax_rad, ay_rad]])[0]
        return homography

    def at_each(self, gazes_rad: ArrayLike) -> NDArray[np.float64]:
        """Return the (n, 3, 3) float64 homographies of gazes (n, 2), each with the last entry 1.

        One maps a raw fovea pixel (x, y, 1) to (du, dv, 1): px of the virtual pinhole plane relative to the
        gaze point f (tan ax, tan ay), for what lies at infinity.
        """
        entries = self.polynomial(gazes_rad)
        about_centre = np.zeros((len(entries), 3, 3))
        about_centre[:, :2, :2] = entries[:, :4].reshape(-1, 2, 2)
        about_centre[:, 2, :2] = entries[:, 4:] / self.scale_px
        about_centre[:, 2, 2] = 1.0
        cx_px, cy_px = self.centre_px
        centred = np.array([[1.0, 0.0, -cx_px], [0.0, 1.0, -cy_px], [0.0, 0.0, 1.0]])
        homographies: NDArray[np.float64] = about_centre @ centred
        homographies /= homographies[:, 2:, 2:]
        return homographies
