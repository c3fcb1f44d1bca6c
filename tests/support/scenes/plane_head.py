"""A Head of one textured plane facing the rig, drawn with the calibration's own model: for tests of loops.

The simulated rig has its own physics and is what figures are measured on; this one is small and exact.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    Binning,
    Frame,
    LookOptions,
    Role,
    Sighting,
    StereoVolts,
    VirtualClock,
)
from foveacam_pipeline.models import Calibration, Intrinsics, load_calibration
from foveacam_pipeline.stereo.rectify import plane_from_raw
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

CALIBRATION = load_calibration(Path(__file__).parents[2] / "data" / "rig120-calibration.json")
MEASURED = load_calibration(SHIPPED / "sim-rig120.json")
"""As the procedures measured it; it is written anew when they or the simulated rig change."""
TEXEL_M = 0.4e-3
TILE = 2048
NOISE_SHAPE = (2160, 2880)
"""Twice a picture's height and width: the noise of a picture is cut out of it at a place of its own."""
LOOK_NS = 33_000_000
EXPOSURE_NS = 8_000_000

Texture = NDArray[np.float32]
"""(2048, 2048) float32 grey levels, repeating every 0.82 m."""


@cache
def noise_texture(seed: int = 3) -> Texture:
    """Return grey noise of all sizes, like paint and stone: amplitude falls as the frequency rises.

    One array for everybody, not to be written to.
    """
    rng = np.random.default_rng(seed)
    frequency = np.fft.fftfreq(TILE)
    radius = np.hypot(frequency[:, None], frequency[None, :])
    radius[0, 0] = np.inf
    spectrum = np.fft.fft2(rng.standard_normal((TILE, TILE))) / radius
    grain = np.fft.ifft2(spectrum).real
    return np.asarray(128.0 + 35.0 * grain / grain.std(), dtype=np.float32)


@cache
def _camera_noise() -> NDArray[np.float32]:
    return np.random.default_rng(1).standard_normal(NOISE_SHAPE, dtype=np.float32)


def plain_texture() -> Texture:
    return np.full((TILE, TILE), 128.0, dtype=np.float32)


def still(t_ns: int) -> tuple[float, float]:
    return 0.0, 0.0


def no_passer(t_ns: int) -> float | None:
    return None


@cache
def _wide_tan(wide: Intrinsics) -> NDArray[np.float64]:
    """Return tan of both angles of every pixel, (h, w, 2)."""
    columns, rows = np.meshgrid(np.arange(wide.width), np.arange(wide.height))
    pixels = np.column_stack([columns.ravel(), rows.ravel()])
    return np.asarray(np.tan(wide.angles_rad(pixels)).reshape(wide.height, wide.width, 2))


def _scaled(scale: float, x: float, y: float) -> NDArray[np.float64]:
    return np.array([[scale, 0.0, x], [0.0, scale, y], [0.0, 0.0, 1.0]])


def _in_first_tile(texels: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.float64]:
    """Move a homography of pixels to texels by whole tiles, so that the picture begins in the first."""
    width, height = size
    corners = np.array([[(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)]])
    begin = cv2.perspectiveTransform(corners, texels)[0].min(axis=0)
    x, y = (-TILE * np.floor(begin / TILE)).tolist()
    return _scaled(1.0, x, y) @ texels


@dataclass(frozen=True)
class _Painted:
    """A texture, equal to another when it is the same array."""

    texture: Texture = field(compare=False)
    number: int


@lru_cache(maxsize=2)
def _surface(
    painted: _Painted, z_m: float, wide: Intrinsics, fovea_f_px: float
) -> tuple[Texture, Texture, NDArray[np.float32]]:
    """Return a texture as the wide camera and as a fovea resolve it, and (2, h, w) texels of wide pixels.

    Each is 2 x 2 tiles; most heads of a file look at one surface, which takes a fifth of a second to prepare.
    """
    coarse = np.tile(_blurred(painted.texture, 0.7 * z_m / wide.fx_px / TEXEL_M), (2, 2))
    fine = np.tile(_blurred(painted.texture, 1.4 * z_m / fovea_f_px / TEXEL_M), (2, 2))
    texels = np.mod((_wide_tan(wide) * (z_m / TEXEL_M)).astype(np.float32), np.float32(TILE))
    return coarse, fine, np.ascontiguousarray(np.moveaxis(texels, 2, 0))


def _blurred(texture: Texture, sigma_px: float) -> Texture:
    wrapped = np.pad(texture, 64, mode="wrap")
    blurred = cv2.GaussianBlur(wrapped, (0, 0), max(0.3, sigma_px))
    return np.ascontiguousarray(blurred[64:-64, 64:-64], dtype=np.float32)


def _middles(texels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the texels in the middles of 2 x 2 pixels, (2, h / 2, w / 2), from those of each, (2, h, w).

    Neighbours lie on both sides of a tile's edge now and then: half their difference is taken within a tile.
    """
    first, last = texels[:, ::2, ::2], texels[:, 1::2, 1::2]
    half = np.mod(last - first + TILE / 2, np.float32(TILE)) - TILE / 2
    return np.ascontiguousarray(first + half / 2, dtype=np.float32)


@dataclass
class PlaneHead:
    """Looks at a plane at depth `z_m`; `shift_m(t_ns)` moves it; `blind` eyes see another picture.

    `binning`: of its frames; 2 is drawn in a quarter of the time.
    `knocked_rad`: how far an eye looks to the right and down of where its calibration says.
    `passer_px(t_ns)`: column of the wide view at which somebody stands in the left eye's way; None: nobody.
    """

    z_m: float
    texture: Texture
    clock: VirtualClock = field(default_factory=VirtualClock)
    noise: float = 1.0
    shift_m: Callable[[int], tuple[float, float]] = still
    blind: frozenset[Role] = frozenset()
    passer_px: Callable[[int], float | None] = no_passer
    knocked_rad: Mapping[Role, tuple[float, float]] = field(default_factory=dict)
    calibration: Calibration = CALIBRATION
    looks: int = 0
    look_ns: int = LOOK_NS
    binning: Binning = 1

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(1)
        painted = _Painted(texture=self.texture, number=id(self.texture))
        wide, fovea_f_px = self.calibration.wide, self.calibration.fovea_f_px
        self._coarse, self._fine, texels = _surface(painted, self.z_m, wide, fovea_f_px)
        self._wide_texels = texels if self.binning == 1 else _middles(texels)

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        t_ns = self.clock.now_ns()
        x_m, y_m = self.shift_m(t_ns)
        x = self._wide_texels[0] + np.float32(-x_m / TEXEL_M % TILE)
        y = self._wide_texels[1] + np.float32(-y_m / TEXEL_M % TILE)
        drawn = cv2.remap(self._coarse, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        image = self._noisy(drawn)
        column_px = self.passer_px(t_ns)
        if column_px is not None:
            first, last = (max(0, round(column_px) + side_px) // self.binning for side_px in (-20, 20))
            image[:, first:last] = 40
        return Frame(
            image=image, role=Role.WIDE, seq=t_ns, t_ns=t_ns, exposure_ns=EXPOSURE_NS, binning=self.binning
        )

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        self.looks += 1
        self.clock.sleep_until_ns(self.clock.now_ns() + self.look_ns)
        left, right = (self._fovea(role, volts) for role in (Role.LEFT, Role.RIGHT))
        return Sighting(left=left, right=right, wide=self.wide(), volts=volts)

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        raise NotImplementedError("a painted head has no exposure")

    def set_low_pass(self, cutoff_hz: int) -> int:
        raise NotImplementedError("a painted head has no filter")

    def _fovea(self, role: Role, volts: StereoVolts) -> Frame:
        calibration, t_ns = self.calibration, self.clock.now_ns()
        size = (calibration.fovea_width, calibration.fovea_height)
        beside_m = self.z_m * np.array(self.knocked_rad.get(role, (0.0, 0.0)))
        x_m, y_m = calibration.reference_rig_m(role)[:2] + beside_m
        there = _scaled(self.z_m / calibration.fovea_f_px, x_m, y_m)
        there = there @ plane_from_raw(calibration, role, volts, depth_m=self.z_m)
        hidden = role is Role.LEFT and self.passer_px(t_ns) is not None
        if hidden or role in self.blind:
            turned = np.array([[-1.0, 0.0, size[0] - 1.0], [0.0, -1.0, size[1] - 1.0], [0.0, 0.0, 1.0]])
            there = _scaled(0.7, 0.31, 0.31) @ there @ turned
        shift_x_m, shift_y_m = self.shift_m(t_ns)
        texels = _in_first_tile(
            _scaled(1.0 / TEXEL_M, -shift_x_m / TEXEL_M, -shift_y_m / TEXEL_M) @ there, size
        )
        middle = (self.binning - 1) / 2.0
        texels = texels @ _scaled(self.binning, middle, middle)
        size = (size[0] // self.binning, size[1] // self.binning)
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        drawn = cv2.warpPerspective(self._fine, texels, size, flags=flags, borderMode=cv2.BORDER_WRAP)
        return Frame(
            image=self._noisy(drawn),
            role=role,
            seq=self.looks,
            t_ns=t_ns,
            exposure_ns=EXPOSURE_NS,
            volts=volts.left if role is Role.LEFT else volts.right,
            binning=self.binning,
        )

    def _noisy(self, drawn: cv2.typing.MatLike) -> NDArray[np.uint8]:
        height, width = drawn.shape
        y, x = self._rng.integers(NOISE_SHAPE[0] - height), self._rng.integers(NOISE_SHAPE[1] - width)
        noise = _camera_noise()[y : y + height, x : x + width]
        return np.asarray(
            cv2.addWeighted(drawn, 1.0, noise, self.noise, 0.0, dtype=cv2.CV_8U), dtype=np.uint8
        )
