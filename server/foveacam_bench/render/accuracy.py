"""Measure the accuracy of rendered images: disparity by two matchers, depth, shimmer, bitwise equality.

Affine Lucas-Kanade on clean pictures measures the renderer alone; normalised correlation on pictures with
diffraction, noise and 8 bits measures what a procedure obtains.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.render.scene import (
    FOVEA_F_PX,
    PANEL_M,
    WIDE_F_PX,
    measured_scene,
    panel_scene,
    verged_pair,
    wide_view,
)
from foveacam_hardware.sim.render import Projection, Renderer, Scene, SensorExposure, expose, place
from foveacam_pipeline.matching.correlation import peak, score_map

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

LK_HALF, NCC_HALF, NCC_SEARCH = 20, 15, 4
MARGIN = 60
DISTANCES_M = (5.0, 10.0, 15.0, 30.0)


def disparity_errors_px(*, points: int) -> tuple[F64, F64]:
    """Return the errors of affine Lucas-Kanade (clean) and of correlation (blur, noise, 8 bits)."""
    clean, noisy = [], []
    views = [(FOVEA_F_PX, 1.4, distance_m) for distance_m in DISTANCES_M] + [(WIDE_F_PX, 0.6, 10.0)]
    for f_px, psf_sigma_px, distance_m in views:
        left, right = verged_pair(f_px, distance_m)
        with Renderer(panel_scene(distance_m)) as renderer:
            a, b = renderer.radiance(left).radiance, renderer.radiance(right).radiance
            truth, seen = renderer.disparity(left, right)
        where = _points(points, seen)
        clean.append([_lucas_kanade(a, b, x, y, float(truth[y, x])) - truth[y, x] for x, y in where])
        exposure = SensorExposure(psf_sigma_px=psf_sigma_px, bits=8)
        p = expose(a, exposure, (1, 1, 1)).astype(np.float32)
        q = expose(b, exposure, (1, 2, 1)).astype(np.float32)
        noisy.append([_correlate(p, q, x, y, float(truth[y, x])) - truth[y, x] for x, y in where])
    return np.concatenate(clean), np.concatenate(noisy)


def _points(count: int, seen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    rng = np.random.default_rng(5)
    height, width = seen.shape
    found: list[tuple[int, int]] = []
    while len(found) < count:
        x, y = int(rng.integers(MARGIN, width - MARGIN)), int(rng.integers(MARGIN, height - MARGIN))
        if seen[y - LK_HALF : y + LK_HALF + 1, x - LK_HALF : x + LK_HALF + 1].all():
            found.append((x, y))
    return found


def _lucas_kanade(left: F32, right: F32, x: int, y: int, start_px: float) -> float:
    """Fit disparity d + a·u + b·v, gain and offset in a window about (x, y); return d."""
    v, u = np.mgrid[-LK_HALF : LK_HALF + 1, -LK_HALF : LK_HALF + 1].astype(np.float64)
    want = left[y - LK_HALF : y + LK_HALF + 1, x - LK_HALF : x + LK_HALF + 1].astype(np.float64).ravel()
    x0 = x - round(start_px) - LK_HALF - 12
    y0 = y - LK_HALF - 12
    patch = right[y0 : y + LK_HALF + 13, x0 : x0 + 2 * LK_HALF + 25].astype(np.float64)
    from scipy import ndimage  # slow to import

    spline = ndimage.spline_filter(patch, order=5)
    d, a, b, gain, offset = float(round(start_px)), 0.0, 0.0, 1.0, 0.0

    def sample(shift: float) -> F64:
        at = np.stack([y + v - y0, x + u - (d + a * u + b * v) - x0 + shift]).reshape(2, -1)
        values: F64 = ndimage.map_coordinates(spline, at, order=5, prefilter=False)
        return values

    for _ in range(12):
        here, slope = sample(0.0), (sample(0.05) - sample(-0.05)) / 0.1
        jacobian = np.column_stack(
            [-gain * slope, -gain * slope * u.ravel(), -gain * slope * v.ravel(), here, np.ones_like(here)]
        )
        step = np.linalg.lstsq(jacobian, want - gain * here - offset, rcond=None)[0]
        d, a, b, gain, offset = d + step[0], a + step[1], b + step[2], gain + step[3], offset + step[4]
        if abs(step[0]) < 1e-5:
            break
    return float(d)


def _correlate(left: F32, right: F32, x: int, y: int, start_px: float) -> float:
    """Return the disparity of the best integer shift, refined by a parabola."""
    x0 = x - round(start_px)
    n, m = NCC_HALF, NCC_SEARCH
    template = left[y - n : y + n + 1, x - n : x + n + 1]
    strip = right[y - n : y + n + 1, x0 - n - m : x0 + n + m + 1]
    shift_px, _, _ = peak(score_map(strip, template))
    return x - (x0 + shift_px - m)


def depth_max_rel_error() -> float:
    """Return the largest relative error of depth on a wall."""
    worst = 0.0
    for distance_m in DISTANCES_M:
        pose = place((0.0, 0.0, distance_m), yaw_rad=0.3, pitch_rad=0.15)
        for view in (*verged_pair(FOVEA_F_PX, distance_m), wide_view()):
            with Renderer(panel_scene(distance_m)) as renderer:
                depth = renderer.radiance(view).depth_m.astype(np.float64)
            rows, columns = np.nonzero(np.isfinite(depth))
            rays = view.rays_at(np.column_stack([columns, rows]))
            normal = pose[:3, 2]
            truth = (normal @ (pose[:3, 3] - view.C)) / (rays @ normal)
            worst = max(worst, float(np.max(np.abs(depth[rows, columns] / truth - 1.0))))
    return worst


def binned_difference(view: Projection, *, psf_sigma_px: float) -> float:
    """Return the rms difference of a binned picture from the full-size one averaged 2x2, over its noise."""
    ideal = SensorExposure(full_well_e=1e12, read_noise_e=0.0, bits=12, psf_sigma_px=psf_sigma_px)
    with Renderer(measured_scene(), cached_frames=2) as renderer:
        whole = expose(renderer.radiance(view).radiance, ideal, (0, 0, 0))
        half = renderer.radiance(view.halved()).radiance
    binned = expose(half, replace(ideal, binning=2), (0, 0, 0))
    difference = binned - whole.reshape(*binned.shape[:1], 2, binned.shape[1], 2).mean(axis=(1, 3))
    real = SensorExposure()
    electrons = float(binned.mean()) / 4095 * real.full_well_e
    noise = 0.5 * np.sqrt(electrons + real.read_noise_e**2) / real.full_well_e * 4095
    return float(np.sqrt(np.mean(difference**2)) / noise)


def shimmer() -> float:
    """Return the change of a surface's brightness when the camera pans by fractions of a pixel.

    Wide pictures panned by eighths of a pixel are shifted back. The result is the largest ratio of their
    standard deviation over the pans to that over the texture, of patches on panel, ground and box.
    """
    pans = [(k / 8, (3 * k % 8) / 8) for k in range(8)]
    with Renderer(measured_scene(), cached_frames=1) as renderer:
        frames = [renderer.radiance(wide_view(dx_px=dx, dy_px=dy)).radiance for dx, dy in pans]
    centre = np.array(PANEL_M[:2]) / PANEL_M[2] * WIDE_F_PX + (719.5, 539.5)
    patches = [(int(centre[0]), int(centre[1])), (620, 950), (230, 760)]
    return max(_relative_deviation(frames, pans, x, y) for x, y in patches)


def _relative_deviation(frames: list[F32], pans: list[tuple[float, float]], x: int, y: int) -> float:
    from scipy import ndimage  # slow to import

    shifted = []
    for frame, (dx, dy) in zip(frames, pans, strict=True):
        patch = frame[y - 80 : y + 80, x - 80 : x + 80].astype(np.float64)
        shifted.append(ndimage.shift(patch, (-dy, -dx), order=5)[20:-20, 20:-20])
    stack = np.stack(shifted)
    return float(np.sqrt(stack.var(axis=0).mean()) / stack.mean(axis=0).std())


def bits_are_equal() -> bool:
    """Return whether radiance, depth and ids are equal bit by bit for all threads, regions and histories."""
    view, scene = wide_view(), measured_scene()
    home, away = scene.pose(1), place((-0.8, 0.4, 6.5), yaw_rad=0.9)
    with Renderer(scene, threads=1) as one, Renderer(scene, threads=2) as two:
        alone = _bits(one, view)
        equal = _bits(two, view) == alone
        equal &= _region_bits(scene, view) == _cropped_bits(one, view)
        scene.set_pose(1, away)
        moved = _bits(two, view)
        with Renderer(scene, threads=1) as fresh:
            equal &= moved == _bits(fresh, view)
        scene.set_pose(1, home)
        return equal and moved != alone and _bits(two, view) == alone


ROI = (301, 203, 517, 411)


def _bits(renderer: Renderer, view: Projection) -> bytes:
    frame = renderer.radiance(view, channels=3)
    return frame.radiance.tobytes() + frame.depth_m.tobytes() + frame.ids.tobytes()


def _region_bits(scene: Scene, view: Projection) -> bytes:
    with Renderer(scene, threads=2) as renderer:
        return renderer.radiance(view, roi=ROI, channels=3).radiance.tobytes()


def _cropped_bits(renderer: Renderer, view: Projection) -> bytes:
    x, y, w, h = ROI
    return np.ascontiguousarray(renderer.radiance(view, channels=3).radiance[y : y + h, x : x + w]).tobytes()
