"""Measure point matching: bias over the sub-pixel phase, error against its bound, and the stated errors.

The stated errors are judged on rendered and on real pairs.

`python -m foveacam_bench.depth.matching [--quick] [--curve FILE.svg] [--data FOLDER]` prints the figures.
Cramér-Rao bound: the standard error of the shift between two noisy pictures of one unknown scene is at least
the root of (v1 + v2) / G, with G the gradient energy of the noiseless scene over the window, here with
unknown disparity slopes too. The variance v of a pixel is the simulated sensor's: shot, read, rounding.
"""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_bench.depth.real_pairs import real_figures
from foveacam_bench.figures import Figures
from foveacam_hardware.contract import Role
from foveacam_hardware.sim.render.sensor import SensorExposure, expose
from foveacam_hardware.sim.sensor import PSF_SIGMA_PX, REFERENCE_S
from foveacam_pipeline.matching.picture import InterpolatedPicture, WindowPlacement
from foveacam_pipeline.matching.point import PositionPrior, match_point
from foveacam_pipeline.matching.windows import MatchWindow

F32 = NDArray[np.float32]
SIDE_PX = 256
PHASES = tuple(k / 16 for k in range(17))
QUIET_SIGMA_PX = 1.5
FLAT = MatchWindow(half_px=40, weight_sigma_px=1e4)
"""A window of equal weights, for which the bound is exact."""
BELL = MatchWindow(half_px=64, weight_sigma_px=28.0)
EXPOSURE = SensorExposure(exposure_s=0.008, reference_s=REFERENCE_S, psf_sigma_px=PSF_SIGMA_PX[Role.LEFT])
NOISELESS = SensorExposure(
    exposure_s=0.008,
    reference_s=REFERENCE_S,
    psf_sigma_px=PSF_SIGMA_PX[Role.LEFT],
    full_well_e=1e9,
    bits=12,
)
MEAN, CONTRAST = 0.4, 0.1
SEED = 41
LIMIT_PX = 0.005
SCENES, QUICK_SCENES = 6, 2
PAIRS, QUICK_PAIRS = 200, 40


def run(*, quick: bool = False, curve: Path | None = None, data: Path | None = None) -> Figures:
    """Return the figures; write the bias curve to `curve`. `data`: folder of aloe/ and tsukuba/, if any."""
    scenes = QUICK_SCENES if quick else SCENES
    noise_bias, optics_bias = (bias_curve(rendered, scenes=scenes) for rendered in (False, True))
    if curve is not None:
        write_curve(curve, PHASES, {"band-limited noise": noise_bias, "simulated optics": optics_bias})
    both = np.abs(np.concatenate([noise_bias, optics_bias]))
    return {
        "match_bias_px": float(both.max()),
        "match_bias_cubic_px": _cubic_bias_px(),
        "match_bias_noise_px": float(np.abs(noise_bias).max()),
        "match_bias_optics_px": float(np.abs(optics_bias).max()),
        "match_bias_curve_px": {
            str(phase): [float(one), float(two)]
            for phase, one, two in zip(PHASES, noise_bias, optics_bias, strict=True)
        },
        **against_bound(pairs=QUICK_PAIRS if quick else PAIRS),
        **real_figures(data, points=150 if quick else 900),
    }


def worst_bias_px(*, scenes: int) -> float:
    """Return the largest error at any phase, with and without the simulated optics, px."""
    return max(float(np.abs(bias_curve(optics, scenes=scenes)).max()) for optics in (False, True))


def _cubic_bias_px() -> float:
    """Return the largest error of OpenCV's cubic interpolation on a ramp, px, for comparison."""
    ramp = np.tile(np.arange(40, dtype=np.float32), (9, 1))
    errors = []
    for phase in PHASES:
        matrix = np.array([[1.0, 0.0, 10.0 + phase], [0.0, 1.0, 2.0]])
        view = cv2.warpAffine(ramp, matrix, (11, 5), flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP)
        errors.append(float(view[2, 3]) - 13.0 - phase)
    return float(np.abs(errors).max())


def bias_curve(through_optics: bool, *, scenes: int) -> NDArray[np.float64]:
    """Return the signed error of the worst scene and axis at each phase, px."""
    errors = np.zeros((scenes, len(PHASES), 2))
    for scene in range(scenes):
        first = _observed(_shifted(scene, 0.0, 0.0), through_optics, key=(scene, 0, 0))
        for k, phase in enumerate(PHASES):
            second = _observed(_shifted(scene, phase, 1.0 - phase), through_optics, key=(scene, 1, k))
            start = WindowPlacement(x_px=round(phase), y_px=1.0 - round(phase))
            found = match_point(first, second, start, window=BELL, prior=PositionPrior())
            if found is None:
                raise AssertionError(f"bench matching: scene {scene} at phase {phase} was not matched")
            errors[scene, k] = found.position_px - (phase, 1.0 - phase)
    by_phase = errors.transpose(1, 0, 2).reshape(len(PHASES), -1)
    worst = np.abs(by_phase).argmax(axis=1)
    return np.asarray(by_phase[np.arange(len(PHASES)), worst], dtype=np.float64)


def against_bound(*, pairs: int) -> dict[str, float]:
    """Return the error at the default noise over its bound, and the shares within the stated errors."""
    rng = np.random.default_rng(SEED)
    errors, bounds, sigmas = [], [], []
    for pair in range(pairs):
        x, y = rng.uniform(-0.5, 0.5, 2).tolist()
        shown = [_shifted(pair, 0.0, 0.0), _shifted(pair, x, y)]
        one, two = (
            _picture(expose(image, EXPOSURE, (SEED, eye, pair)).astype(np.float32))
            for eye, image in enumerate(shown)
        )
        found = match_point(one, two, WindowPlacement(), window=FLAT, prior=PositionPrior())
        if found is None:
            raise AssertionError(f"bench matching: pair {pair} was not matched")
        errors.append(found.placement.x_px - x)
        sigmas.append(found.sigma_px[0])
        bounds.append(_bound_px(shown[0]))
    error, sigma = np.array(errors), np.array(sigmas)
    return {
        "rms_over_crb": float(np.sqrt(np.mean(error**2) / np.mean(np.square(bounds)))),
        "match_rms_px": float(np.sqrt(np.mean(error**2))),
        "crb_px": float(np.sqrt(np.mean(np.square(bounds)))),
        "match_within_1_sigma": float((np.abs(error) <= sigma).mean()),
        "match_within_3_sigma": float((np.abs(error) <= 3.0 * sigma).mean()),
    }


def _bound_px(radiance: F32) -> float:
    """Return the bound of the standard error along x over the flat window; row and two slopes are unknown."""
    scale = 255.0 / EXPOSURE.full_well_e
    light = EXPOSURE.full_well_e * EXPOSURE.exposure_s / EXPOSURE.reference_s
    blurred = cv2.GaussianBlur(radiance, (0, 0), EXPOSURE.psf_sigma_px)
    electrons = np.asarray(light * blurred, dtype=np.float64)
    variance = scale**2 * (electrons + EXPOSURE.read_noise_e**2) + 1.0 / 12.0
    down, right = (np.asarray(slope) for slope in np.gradient(scale * electrons))
    middle, half = SIDE_PX // 2, FLAT.half_px
    part = (slice(middle - half, middle + half + 1),) * 2
    axis = np.arange(-half, half + 1, dtype=np.float64)
    right, down = right[part], down[part]
    columns = [right, down, right * axis[None, :], right * axis[:, None], np.ones_like(right)]
    matrix = np.stack([column.ravel() for column in columns]) / np.sqrt(2.0 * variance[part].ravel())
    return math.sqrt(float(np.linalg.inv(matrix @ matrix.T)[0, 0]))


def _observed(radiance: F32, through_optics: bool, *, key: tuple[int, int, int]) -> InterpolatedPicture:
    """Return the picture of a scene, directly or as exposed by a noiseless camera."""
    return _picture(expose(radiance, NOISELESS, key).astype(np.float32) if through_optics else 255 * radiance)


def _picture(image: F32) -> InterpolatedPicture:
    quiet = cv2.GaussianBlur(image, (0, 0), QUIET_SIGMA_PX)[1:, 1:]
    return InterpolatedPicture.of(np.asarray(quiet, dtype=np.float32))


def _shifted(seed: int, x_px: float, y_px: float) -> F32:
    """Return 1/f noise up to 0.4 cycles/px, shifted exactly, (256, 256) float32 radiance."""
    white = np.fft.rfft2(np.random.default_rng([SEED, seed]).standard_normal((SIDE_PX, SIDE_PX)))
    down, right = np.fft.fftfreq(SIDE_PX)[:, None], np.fft.rfftfreq(SIDE_PX)[None, :]
    frequency = np.hypot(down, right)
    gain = np.where((frequency > 2.0 / SIDE_PX) & (frequency < 0.4), 1.0 / np.maximum(frequency, 1e-9), 0.0)
    moved = np.exp(-2j * np.pi * (right * x_px + down * y_px))
    still = np.fft.irfft2(white * gain, s=(SIDE_PX, SIDE_PX))
    scene = np.fft.irfft2(white * gain * moved, s=(SIDE_PX, SIDE_PX)) / still.std()
    return np.asarray(MEAN + CONTRAST * scene, dtype=np.float32)


def _option(name: str) -> Path | None:
    return Path(sys.argv[sys.argv.index(name) + 1]) if name in sys.argv else None


def write_curve(path: Path, phases: Sequence[float], curves: Mapping[str, NDArray[np.float64]]) -> None:
    """Draw the curves with the limit of ±0.005 px."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.0), layout="constrained")
    axes = figure.subplots()
    for name, curve in curves.items():
        axes.plot(phases, curve, label=name)
    for limit_px in (-LIMIT_PX, LIMIT_PX):
        axes.axhline(limit_px, ls="--", color="0.6")
    axes.set(title="Bias of a match over the sub-pixel phase", xlabel="phase along x, px", ylabel="bias, px")
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


if __name__ == "__main__":
    figures = run(quick="--quick" in sys.argv, curve=_option("--curve"), data=_option("--data"))
    json.dump(figures, sys.stdout, indent=1)
