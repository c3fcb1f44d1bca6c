"""Small datasets for tests: noise where only bytes matter, a painted plane where the geometry does."""

import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, Image, MirrorVolts, Role, StereoVolts
from foveacam_pipeline.capture.dataset import (
    CapturedPoint,
    Dataset,
    DatasetHeader,
    DatasetWriter,
    PlanPosition,
    Shot,
    WriterSettings,
)
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.stereo.rectify import plane_from_raw

CALIBRATION = load_calibration(Path(__file__).parents[2] / "data" / "rig120-calibration.json")
CREATED = "2026-01-01T00:00:00+00:00"
Grey = NDArray[np.uint8]


def header(points: int, *, calibration: Calibration | None = None, capture_id: str = "test") -> DatasetHeader:
    """Return what two runs of a test have in common."""
    return DatasetHeader(
        points=points, calibration=calibration, id=capture_id, created_utc=CREATED, label="a test"
    )


def noise_frame(role: Role, index: int, *, bits: int = 8, stack: int = 0, color: bool = False) -> Frame:
    """Return the same small noise whenever it is asked for."""
    rng = np.random.default_rng((index, list(Role).index(role), stack))
    shape = (6, 8, 3) if color else (6, 8)
    levels = rng.integers(0, 2**bits, shape)
    image: Image = levels.astype(np.uint8) if bits == 8 else levels.astype(np.uint16)
    volts = None if role is Role.WIDE else MirrorVolts(x_v=10.0 * index, y_v=-5.5)
    return Frame(
        image=image, role=role, seq=index, t_ns=10**9 + index, exposure_ns=5_000_000, bits=bits, volts=volts
    )


def noise_point(index: int, *, scan: int = 0) -> CapturedPoint:
    """Return a point of left, right and wide; two points make a row of the grid."""
    place = PlanPosition(index=index, scan=scan, column=index % 2, row=index // 2 % 2, aim_rad=(0.1, -0.05))
    return CapturedPoint(place=place, shots=tuple(Shot(frame=noise_frame(role, index)) for role in Role))


def written(
    folder: Path, points: int, *, settings: WriterSettings | None = None, capture_id: str = "test"
) -> Dataset:
    """Return a complete dataset of noise."""
    about = replace(header(points), id=capture_id)
    with DatasetWriter.create(folder, about, settings or WriterSettings()) as writer:
        for index in range(points):
            writer.add(noise_point(index))
        writer.finish()
    return Dataset.open(folder)


def painted(folder: Path, points: list[CapturedPoint]) -> Dataset:
    """Return a complete dataset of these points, with the calibration that they are painted by."""
    with DatasetWriter.create(folder, header(len(points), calibration=CALIBRATION)) as writer:
        for point in points:
            writer.add(point)
        writer.finish()
    return Dataset.open(folder)


def noise_texture(seed: int = 1) -> Grey:
    """Return grain as large as the optics let through, for a field as large as a fovea's."""
    rng = np.random.default_rng(seed)
    grain = cv2.GaussianBlur(rng.standard_normal((1300, 1700)).astype(np.float32), (0, 0), 1.6)
    return np.asarray(np.clip(128.0 + 160.0 * grain, 0, 255), dtype=np.uint8)


def plane_point(
    index: int, *, aim_deg: tuple[float, float], z_m: float, texture: Grey | None = None, rail_m: float = 0.0
) -> tuple[CapturedPoint, NDArray[np.float64]]:
    """Return a point that looks at a plane at z_m, and the (3,) place on it, rig frame, of a bright dot.

    Without a texture the plane is black; the dot is where the gazes meet, a little aside.
    """
    aim_rad = math.radians(aim_deg[0]), math.radians(aim_deg[1])
    tangents = np.array([math.tan(aim_rad[0]), math.tan(aim_rad[1]), 1.0])
    distance_m = z_m * float(np.linalg.norm(tangents))
    volts = CALIBRATION.steer(*aim_rad, distance_m=distance_m)
    dot_m = z_m * tangents + np.array([0.03, -0.02, 0.0]) * z_m / 5.0
    place = PlanPosition(
        index=index, column=index, row=0, aim_rad=aim_rad, distance_m=distance_m, rail_m=rail_m
    )
    left, right = (
        _fovea(role, volts, centre_m=z_m * tangents, dot_m=dot_m, texture=texture)
        for role in (Role.LEFT, Role.RIGHT)
    )
    wide = _wide(dot_m)
    return CapturedPoint(place=place, shots=tuple(Shot(frame=frame) for frame in (left, right, wide))), dot_m


def raw_px(role: Role, volts: StereoVolts, place_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the raw pixel (x, y) at which an eye sees a place of the rig frame."""
    z_m = float(place_m[2])
    to_plane = plane_from_raw(CALIBRATION, role, volts, depth_m=z_m)
    from_eye = place_m - CALIBRATION.reference_rig_m(role)
    raw = np.linalg.solve(to_plane, np.append(CALIBRATION.fovea_f_px * from_eye[:2] / z_m, 1.0))
    return np.asarray(raw[:2] / raw[2], dtype=np.float64)


def spot(shape: tuple[int, int], centre_px: NDArray[np.float64], *, sigma_px: float) -> NDArray[np.float64]:
    """Return (h, w) float64: a bell of height 1."""
    y, x = (np.arange(size) for size in shape)
    bell_x = np.exp(-0.5 * ((x - centre_px[0]) / sigma_px) ** 2)
    bell_y = np.exp(-0.5 * ((y - centre_px[1]) / sigma_px) ** 2)
    return np.asarray(np.outer(bell_y, bell_x))


def centroid(image: NDArray[np.uint8] | NDArray[np.uint16]) -> NDArray[np.float64]:
    """Return where the one bright dot of a picture is, px."""
    light = image.astype(np.float64)
    light[light < 0.1 * light.max()] = 0.0
    y, x = np.indices(light.shape)
    return np.array([(x * light).sum() / light.sum(), (y * light).sum() / light.sum()])


def _fovea(
    role: Role,
    volts: StereoVolts,
    *,
    centre_m: NDArray[np.float64],
    dot_m: NDArray[np.float64],
    texture: Grey | None,
) -> Frame:
    shape = CALIBRATION.fovea_height, CALIBRATION.fovea_width
    if texture is None:
        image = 200.0 * spot(shape, raw_px(role, volts, dot_m), sigma_px=4.0)
    else:
        z_m, f_px = float(centre_m[2]), CALIBRATION.fovea_f_px
        aside = f_px * (CALIBRATION.reference_rig_m(role) - centre_m)[:2] / z_m
        middle = np.array(texture.shape[::-1]) / 2.0
        to_texture = np.eye(3)
        to_texture[:2, 2] = aside + middle
        raw = to_texture @ plane_from_raw(CALIBRATION, role, volts, depth_m=z_m)
        image = cv2.warpPerspective(
            texture, raw, shape[::-1], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        ).astype(np.float64)
    drive = volts.left if role is Role.LEFT else volts.right
    frame = noise_frame(role, 0)
    return replace(frame, image=np.rint(image).astype(np.uint8), volts=drive)


def _wide(dot_m: NDArray[np.float64]) -> Frame:
    wide = CALIBRATION.wide
    pixel = wide.pixels(np.arctan(dot_m[None, :2] / dot_m[2]))[0]
    image = 200.0 * spot((wide.height, wide.width), pixel, sigma_px=3.0)
    return replace(noise_frame(Role.WIDE, 0), image=np.rint(image).astype(np.uint8))
