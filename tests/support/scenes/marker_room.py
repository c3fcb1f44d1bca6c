"""Rooms for tests: scenes changed on purpose, a true lens, and a watcher who takes notes."""

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

import foveacam_hardware.sim.scenes as scenes
from foveacam_hardware.contract import MirrorVolts, PixelFormat, Role
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.optics import WideLens
from foveacam_pipeline.calibrate.sweep.marker_observation import direction_rad, gaze_on_target
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose
from foveacam_pipeline.calibrate.sweep.sweep import EyePose
from foveacam_pipeline.models.intrinsics import Intrinsics
from tests.support.scenes.simulated_gaze import gaze

ROOM = Path(scenes.__file__).with_name("calibration.toml")
BENCH = ROOM.with_name("bench.toml")
NOISE = re.compile(r'\{kind="noise", color="(#\w+)", accent="(#\w+)".*?\}')
EYES = (Role.LEFT, Role.RIGHT)
SIZE = (1440, 1080)


class RecordingWatcher:
    """Takes note of everything; wants no more once `enough` says so."""

    def __init__(self, enough: Callable[["RecordingWatcher"], bool] | None = None) -> None:
        self.notes: list[tuple[int, int, str]] = []
        self.shown: Counter[str] = Counter()
        self.last: dict[str, NDArray[np.uint8]] = {}
        self._enough = enough

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        self.notes.append((done, total, note))

    def cancelled(self) -> bool:
        return self._enough is not None and self._enough(self)

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        self.shown[name] += 1
        self.last[name] = image


def changed_room(folder: Path, *changes: tuple[str, str], plain: bool = False) -> str:
    """Write the room with some of its text replaced; return the path of the scene file.

    `plain`: its walls have no texture and are drawn in half of the time, for who looks at markers alone.
    """
    text = ROOM.read_text()
    if plain:
        text, count = NOISE.subn(r'{kind="plain", color="\2"}', text)
        assert count > 0
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    path = folder / "room.toml"
    path.write_text(text)
    return str(path)


def bench_with(folder: Path, *names: str) -> str:
    """Write the scene `bench` with some of its objects alone, each where it is; return the path of the file.

    It is drawn in half of the time, for who looks at nothing else.
    """
    head, *objects = BENCH.read_text().split("[[objects]]")
    kept = [text for name in names for text in objects if f'name = "{name}"\n' in text]
    assert len(kept) == len(names)
    path = folder / "bench.toml"
    path.write_text("[[objects]]".join([head, *kept]))
    return str(path)


def make_grey(rig: Rig) -> None:
    """Let all cameras deliver grey values: colours cost time and say nothing about markers."""
    for camera in (rig.wide, rig.left, rig.right):
        camera.configure(replace(camera.settings, pixel_format=PixelFormat.MONO8))


def expose_briefly(rig: Rig) -> None:
    """Expose for an eighth of the time: what moves is drawn fewer times for one picture."""
    for camera in rig.cameras:
        now = camera.settings
        camera.configure(replace(now, exposure_ns=now.exposure_ns // 8, gain_db=now.gain_db + 18.0))


def true_wide() -> Intrinsics:
    """Return the simulated wide lens in the pipeline's model, fitted to its truth (to 1e-7 px)."""
    lens = WideLens()
    across, down = np.meshgrid(np.linspace(0, SIZE[0] - 1, 25), np.linspace(0, SIZE[1] - 1, 19))
    pixels = np.column_stack([across.ravel(), down.ravel()])
    centre = np.array([lens.centre_x_px, lens.centre_y_px])
    tangents = (lens.undistorted_px(pixels) - centre) / lens.focal_px
    points, still = np.column_stack([tangents, np.ones(len(tangents))]), np.zeros(3)

    def left(p: NDArray[np.float64]) -> NDArray[np.float64]:
        matrix = np.array([[p[0], 0.0, p[2]], [0.0, p[1], p[3]], [0.0, 0.0, 1.0]])
        image = np.asarray(cv2.projectPoints(points, still, still, matrix, p[4:])[0])[:, 0]
        return np.asarray(image - pixels, dtype=np.float64).ravel()

    start = np.array([lens.focal_px, lens.focal_px, *centre, 0.0, 0.0, 0.0, 0.0, 0.0])
    scale = np.array([100.0, 100.0, 10.0, 10.0, 0.1, 0.1, 0.01, 0.01, 0.1])
    fx, fy, cx, cy, *distortion = least_squares(left, start, x_scale=scale).x.tolist()
    return Intrinsics(
        width=SIZE[0],
        height=SIZE[1],
        fx_px=fx,
        fy_px=fy,
        cx_px=cx,
        cy_px=cy,
        distortion=tuple(distortion),
    )


def gaze_error_px(rig: Rig, role: Role, eye: EyePose, target: TargetPose, f_px: float) -> NDArray[np.float64]:
    """Return how far the measured gaze of an eye is from the true one, (2,) fovea px; drift counts too."""
    assert rig.truth is not None
    reference = np.array([-0.1 if role is Role.LEFT else 0.1, 0.0, 0.0])
    measured = direction_rad(gaze_on_target(eye.corners, SIZE, target, role), reference)
    view = rig.truth.static_projection(role, MirrorVolts(x_v=eye.volts_v[0], y_v=eye.volts_v[1]))
    ray, normal = gaze(view), target.rotation[:, 2]
    hit = view.centre_m + ray * float((target.middle_m - view.centre_m) @ normal) / float(ray @ normal)
    return np.asarray((measured - direction_rad(hit, reference)) * f_px)
