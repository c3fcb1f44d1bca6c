"""Measure the renderer: CPU time of a frame, threads, cache, start-up, memory, and accuracy of its images.

Times are medians of CPU time on one thread, which other load hardly changes. The speed-up by a second thread
is the ratio of the best wall times of alternating frames. It is measured repeatedly, since other load lowers
it, and printed beside the speed-up of hashing.
"""

import hashlib
import json
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from statistics import median

import numpy as np

from foveacam_bench.judging import peak_memory_kib, rms
from foveacam_bench.render.accuracy import (
    binned_difference,
    bits_are_equal,
    depth_max_rel_error,
    disparity_errors_px,
    shimmer,
)
from foveacam_bench.render.scene import (
    BOX_M,
    PANEL_M,
    STATUE_M,
    fovea_view,
    measured_scene,
    wide_view,
)
from foveacam_hardware.contract import Binning
from foveacam_hardware.sim.render import Projection, Renderer, SensorExposure, expose, place, warm_up

ON_STATUE_M = (STATUE_M[0], -0.2, STATUE_M[2] - 0.4)
ON_BOX_M = (BOX_M[0] + 0.3, BOX_M[1], BOX_M[2] - 0.7)
EXPOSURES = (
    SensorExposure(psf_sigma_px=0.6),
    SensorExposure(psf_sigma_px=1.4),
    SensorExposure(psf_sigma_px=1.4),
)
SPEEDUP_ROUNDS = 12
"""Alternating frames on one thread and on two, whose best times are compared."""
SPEEDUP_REPETITIONS, QUICK_SPEEDUP_REPETITIONS = 5, 2
START = "from foveacam_bench.render.renderer import start_up; start_up()"


def run(*, quick: bool = False) -> dict[str, float | int | bool]:
    """Measure the renderer; `quick` takes fewer samples."""
    warm_up()
    frames = 3 if quick else 9
    planar = max(_cpu_ms(_fovea(PANEL_M), frames), _cpu_ms(_fovea(ON_BOX_M), frames))
    clean, noisy = disparity_errors_px(points=10 if quick else 40)
    figures: dict[str, float | int | bool] = {
        "wide_cpu_ms": _cpu_ms(_wide, frames),
        "fovea_planar_cpu_ms": planar,
        "fovea_mesh_cpu_ms": _cpu_ms(_fovea(ON_STATUE_M), frames),
        "wide_binned_cpu_ms": _cpu_ms(_halved(_wide), frames),
        "fovea_planar_binned_cpu_ms": max(
            _cpu_ms(_halved(_fovea(at_m)), frames) for at_m in (PANEL_M, ON_BOX_M)
        ),
        "fovea_mesh_binned_cpu_ms": _cpu_ms(_halved(_fovea(ON_STATUE_M)), frames),
        "look_cpu_ms": _look_cpu_ms(1, frames),
        "look_binned_cpu_ms": _look_cpu_ms(2, frames),
        "moved_object_cpu_ms": _moved_object_cpu_ms(frames),
        **_speedup_figures(QUICK_SPEEDUP_REPETITIONS if quick else SPEEDUP_REPETITIONS),
        "unchanged_triplets_per_s": _unchanged_triplets_per_s(10 if quick else 40),
        "disparity_rms_px": rms(clean),
        "disparity_bias_px": float(np.mean(clean)),
        "disparity_noise_rms_px": rms(noisy),
        "depth_max_rel_error": depth_max_rel_error(),
        "shimmer": shimmer(),
        "binned_difference_wide": binned_difference(wide_view(), psf_sigma_px=0.6),
        "binned_difference_fovea": max(
            binned_difference(fovea_view(at_m), psf_sigma_px=1.4) for at_m in (PANEL_M, ON_BOX_M, ON_STATUE_M)
        ),
        "bit_equal": bits_are_equal(),
    }
    return figures | _start_up_figures()


def start_up() -> None:
    """Compile and render the first triplet of a new process; print time and memory."""
    begin_s = time.perf_counter()
    warm_up()
    with Renderer(measured_scene()) as renderer:
        for view, exposure in zip(_triplet(), EXPOSURES, strict=True):
            expose(renderer.radiance(view).radiance, exposure, (0, 0, 0))
        rss_mb = peak_memory_kib() * 1024 / 1e6
    json.dump({"kernels_and_triplet_s": time.perf_counter() - begin_s, "rss_mb": rss_mb}, sys.stdout)


def _start_up_figures() -> dict[str, float | int | bool]:
    """Measure a new process, imports included; its kernels have been compiled before."""
    begin_s = time.perf_counter()
    done = subprocess.run(  # noqa: S603 (our own interpreter on a constant)
        [sys.executable, "-c", START], check=True, capture_output=True, text=True
    )
    return {"warm_start_s": time.perf_counter() - begin_s, "rss_mb": float(json.loads(done.stdout)["rss_mb"])}


def _fovea(at_m: tuple[float, float, float]) -> Callable[[float], Projection]:
    return lambda dx_px: fovea_view(at_m, dx_px=dx_px)


def _wide(dx_px: float) -> Projection:
    return wide_view(dx_px=dx_px)


def _halved(view: Callable[[float], Projection]) -> Callable[[float], Projection]:
    return lambda dx_px: view(dx_px).halved()


def _look_cpu_ms(binning: Binning, looks: int) -> float:
    """Return the median CPU time, on one thread, of both foveae's colour pictures with blur and noise."""
    exposure, times_ms = SensorExposure(psf_sigma_px=1.4, binning=binning), []
    with Renderer(measured_scene(), threads=1, cached_frames=2) as renderer:
        for k in range(looks + 1):
            views = [_fovea(at_m)(0.01 * k) for at_m in (PANEL_M, ON_STATUE_M)]
            begin_s = time.process_time()
            for camera, view in enumerate(views):
                projection = view if binning == 1 else view.halved()
                expose(renderer.radiance(projection, channels=3).radiance, exposure, (0, camera, k))
            times_ms.append((time.process_time() - begin_s) * 1e3)
    return median(times_ms[1:])


def _triplet() -> list[Projection]:
    return [wide_view(), fovea_view(PANEL_M), fovea_view(ON_STATUE_M)]


def _cpu_ms(view: Callable[[float], Projection], frames: int) -> float:
    """Return the median CPU time, on one thread, of frames shifted by hundredths of a pixel."""
    times_ms = []
    with Renderer(measured_scene(), threads=1, cached_frames=1) as renderer:
        renderer.radiance(view(-0.01))
        for k in range(frames):
            projection = view(0.01 * k)
            begin_s = time.process_time()
            renderer.radiance(projection)
            times_ms.append((time.process_time() - begin_s) * 1e3)
    return median(times_ms)


def _moved_object_cpu_ms(frames: int) -> float:
    """Return the median CPU time of a wide frame in which only a box has moved."""
    scene, times_ms = measured_scene(), []
    with Renderer(scene, threads=1) as renderer:
        renderer.radiance(wide_view())
        for k in range(frames):
            scene.set_pose(2, place((-0.2, 0.1, 16.0), yaw_rad=0.3 + 0.02 * (k + 1)))
            begin_s = time.process_time()
            renderer.radiance(wide_view())
            times_ms.append((time.process_time() - begin_s) * 1e3)
    return median(times_ms)


def _speedup_figures(repetitions: int) -> dict[str, float]:
    """Return the medians of both speed-ups by a second thread, and the extremes of the renderer's."""
    ours, machine = [], []
    for _ in range(repetitions):
        ours.append(_speedup_2_threads(SPEEDUP_ROUNDS))
        machine.append(_machine_speedup_2_threads(SPEEDUP_ROUNDS))
    return {
        "speedup_2_threads": median(ours),
        "speedup_2_threads_min": min(ours),
        "speedup_2_threads_max": max(ours),
        "machine_speedup_2_threads": median(machine),
    }


def _speedup_2_threads(rounds: int) -> float:
    """Return the ratio of a wide frame's best wall times on one thread and on two."""
    scene, best_s = measured_scene(), [np.inf, np.inf]
    with (
        Renderer(scene, threads=1, cached_frames=1) as one,
        Renderer(scene, threads=2, cached_frames=1) as two,
    ):
        for k in range(rounds):
            for which, renderer in enumerate((one, two)):
                projection = wide_view(dx_px=0.01 * k)
                begin_s = time.perf_counter()
                renderer.radiance(projection)
                best_s[which] = min(best_s[which], time.perf_counter() - begin_s)
    return best_s[0] / best_s[1]


def _machine_speedup_2_threads(rounds: int) -> float:
    """Return the speed-up of hashing by a second thread: the limit of this machine."""
    block, one_s, two_s = bytes(24_000_000), np.inf, np.inf
    with ThreadPoolExecutor(2) as pool:
        for _ in range(rounds):
            begin_s = time.perf_counter()
            for _ in range(2):
                hashlib.sha256(block)
            middle_s = time.perf_counter()
            list(pool.map(hashlib.sha256, (block, block)))
            one_s, two_s = min(one_s, middle_s - begin_s), min(two_s, time.perf_counter() - middle_s)
    return float(one_s / two_s)


def _unchanged_triplets_per_s(rounds: int) -> float:
    """Return the rate of exposures of three cameras while nothing moves."""
    times_s = []
    with Renderer(measured_scene()) as renderer:
        for k in range(rounds + 1):
            begin_s = time.perf_counter()
            for camera, (view, exposure) in enumerate(zip(_triplet(), EXPOSURES, strict=True)):
                expose(renderer.radiance(view).radiance, exposure, (0, camera, k))
            times_s.append(time.perf_counter() - begin_s)
    return 1.0 / median(times_s[1:])
