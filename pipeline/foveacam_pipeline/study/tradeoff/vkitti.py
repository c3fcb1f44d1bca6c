"""Reader of Virtual KITTI 2 as it is unpacked: stereo frames with depth. The data set is not bundled.

`SceneNN/<variation>/frames/{rgb,depth}/Camera_{0,1}/{rgb_%05d.jpg,depth_%05d.png}`, below
`vkitti_2.0.3_rgb` and `vkitti_2.0.3_depth`, or both merged into one folder. Camera_0 is the left one.
"""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.tradeoff.streets import (
    BASELINE_M,
    CAMERA,
    FARTHEST_M,
    NEAREST_M,
    StereoScene,
    seen_by_both,
)

M_PER_STEP = 0.01
"""Depth is stored in whole centimetres; the largest, 655.35 m, is the sky."""
PARTS = ("vkitti_2.0.3_rgb", "vkitti_2.0.3_depth")


@dataclass(frozen=True, slots=True, kw_only=True)
class VkittiFrame:
    """Files of one frame of both cameras, (left, right)."""

    name: str
    images: tuple[Path, Path]
    depths: tuple[Path, Path]


def vkitti_frames(root: Path, *, count: int, variation: str = "clone") -> tuple[VkittiFrame, ...]:
    """Return `count` frames, evenly spread over all scenes, or all where there are fewer.

    Raise InvalidInput where there is no data set, none of that variation, or no depth beside the images.
    """
    if count < 1:
        raise InvalidInput(f"{count} frames of Virtual KITTI 2 were asked for; at least 1 is needed")
    rgb_root, depth_root = _roots(root)
    found = sorted(rgb_root.glob(f"Scene*/{variation}/frames/rgb/Camera_0/rgb_*.jpg"))
    if not found:
        kinds = sorted({path.name for path in rgb_root.glob("Scene*/*") if path.is_dir()})
        raise InvalidInput(
            f"{rgb_root} has no images of the variation '{variation}'; "
            + (f"it has: {', '.join(kinds)}" if kinds else "unpack the archive of images again")
        )
    chosen = np.unique(np.linspace(0, len(found) - 1, min(count, len(found))).round().astype(np.intp))
    return tuple(_frame(found[index], rgb_root, depth_root) for index in chosen)


def _roots(root: Path) -> tuple[Path, Path]:
    """Return the folders below which the scenes' images and depths lie."""
    roots = []
    for part in PARTS:
        below = [folder for folder in (root / part, root) if any(folder.glob("Scene*"))]
        if not below:
            raise InvalidInput(
                f"no Virtual KITTI 2 was found at {root}: neither {part} nor Scene01 is there; unpack "
                f"{' and '.join(PARTS)} into it, or give the folder that holds them"
            )
        roots.append(below[0])
    return roots[0], roots[1]


def _frame(left: Path, rgb_root: Path, depth_root: Path) -> VkittiFrame:
    scene = left.relative_to(rgb_root).parents[3]
    number = left.stem.removeprefix("rgb_")
    return VkittiFrame(
        name=f"{scene.as_posix()} {number}",
        images=(left, left.parent.with_name("Camera_1") / left.name),
        depths=(
            depth_root / scene / "frames" / "depth" / "Camera_0" / f"depth_{number}.png",
            depth_root / scene / "frames" / "depth" / "Camera_1" / f"depth_{number}.png",
        ),
    )


def load_vkitti(frame: VkittiFrame) -> StereoScene:
    """Return the frame as a scene; raise InvalidInput for a file that is missing, broken or of wrong size."""
    left, right = (_image(path) for path in frame.images)
    left_z_m, right_z_m = (_depth_m(path) for path in frame.depths)
    return StereoScene(
        name=frame.name,
        left=left,
        right=right,
        f_px=CAMERA.f_px,
        baseline_m=BASELINE_M,
        truth_z_m=np.where((left_z_m >= NEAREST_M) & (left_z_m <= FARTHEST_M), left_z_m, np.nan).astype(
            np.float32
        ),
        seen=seen_by_both(left_z_m, right_z_m, f_b=CAMERA.f_px * BASELINE_M),
    )


def _image(path: Path) -> NDArray[np.uint8]:
    image = _read(path, cv2.IMREAD_COLOR_RGB)
    _check_size(path, image)
    return np.asarray(image, dtype=np.uint8)


def _depth_m(path: Path) -> NDArray[np.float64]:
    depth = _read(path, cv2.IMREAD_UNCHANGED)
    if depth.dtype != np.uint16 or depth.ndim != 2:
        raise InvalidInput(
            f"{path} is {depth.dtype} of shape {depth.shape}; depth of Virtual KITTI 2 is 16 bit and grey: "
            "unpack its archive again"
        )
    _check_size(path, depth)
    return np.where(depth == 0, np.nan, depth.astype(np.float64) * M_PER_STEP)


def _read(path: Path, flags: int) -> NDArray[np.generic]:
    if not path.is_file():
        raise InvalidInput(f"{path} is missing; unpack Virtual KITTI 2 again, with both cameras")
    image = cv2.imdecode(np.fromfile(path, dtype=np.uint8), flags)
    if image is None:
        raise InvalidInput(f"{path} cannot be read as a picture; unpack its archive of Virtual KITTI 2 again")
    return np.asarray(image)


def _check_size(path: Path, image: NDArray[np.generic]) -> None:
    if image.shape[:2] != (CAMERA.height, CAMERA.width):
        raise InvalidInput(
            f"{path} is {image.shape[1]} x {image.shape[0]} px; Virtual KITTI 2 is {CAMERA.width} x "
            f"{CAMERA.height} px, and its focal length holds for no other size: use the pictures as published"
        )
