"""Resolution of a target: its direction, and the patches of the wide image that represent it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, OutOfRange
from foveacam_pipeline.geometry.binning import picture_px
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.matching.texture import noise_level
from foveacam_pipeline.verge.matching.wide_patch import WidePatch, cut_template, room_px
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.values import DirectionTarget, PixelTarget, RectangleTarget, Target

GROWTH = 1.35


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResolvedTarget:
    """A resolved target: (2,) tangents from the rig's origin; half sides of its patch if it sets them."""

    tangents: NDArray[np.float64]
    half_px: tuple[int, int] | None

    @property
    def angles_rad(self) -> tuple[float, float]:
        """(ax, ay), rad."""
        return math.atan(self.tangents[0]), math.atan(self.tangents[1])


def resolve(target: Target, wide: Intrinsics, limits: VergeSettings) -> ResolvedTarget:
    """Return a target's direction and patch size, or raise InvalidInput or OutOfRange."""
    if isinstance(target, DirectionTarget):
        _finite(target.ax_rad, target.ay_rad, name="direction")
        return ResolvedTarget(tangents=np.tan([target.ax_rad, target.ay_rad]), half_px=None)
    if isinstance(target, PixelTarget):
        wide.check_pixel(target.x_px, target.y_px)
        return ResolvedTarget(tangents=_tangents(wide, target.x_px, target.y_px), half_px=None)
    return _rectangle(target, wide, limits)


def patches_for(
    gray: NDArray[np.uint8], aim: ResolvedTarget, wide: Intrinsics, limits: VergeSettings
) -> tuple[WidePatch, ...]:
    """Cut the patches to search for, best first: as small as the texture allows, then others.

    A rectangle sets its own size. Raise OutOfRange when the target is too near to the image's edge.
    """
    room = room_px(wide, aim.tangents)
    pixel = wide.pixels(np.array([aim.angles_rad]))[0]
    if room < limits.template_half_min_px:
        x, y = pixel.tolist()
        raise OutOfRange(
            f"target at wide pixel ({x:.1f}, {y:.1f}): {limits.template_half_min_px} px of image are needed "
            f"on every side, the image is {wide.width} x {wide.height} px; choose one nearer to the middle"
        )
    noise = noise_level(gray, at_px=picture_px(pixel, wide.binning_of(gray.shape)))
    largest = min(room, limits.template_half_max_px)

    def cut(half_px: tuple[int, int]) -> WidePatch:
        size = min(half_px[0], room), min(half_px[1], room)
        return cut_template(gray, wide, aim.tangents, half_px=size, noise=noise)

    if aim.half_px is not None:
        return (cut(aim.half_px),)
    half = limits.template_half_px
    template = cut((half, half))
    while template.sigma_px > limits.template_texture_sigma_px and half < largest:
        half = min(largest, round(half * GROWTH))
        template = cut((half, half))
    others = [round(half / limits.template_growth), round(half * limits.template_growth)]
    others = [min(largest, max(limits.template_half_min_px, other)) for other in others]
    return (template, *(cut((other, other)) for other in others if other != half))


def _rectangle(target: RectangleTarget, wide: Intrinsics, limits: VergeSettings) -> ResolvedTarget:
    _finite(target.x_px, target.y_px, target.width_px, target.height_px, name="rectangle")
    wide.check_rectangle(target.x_px, target.y_px, width_px=target.width_px, height_px=target.height_px)
    half_x, half_y = (
        max(limits.template_half_min_px, min(limits.template_half_max_px, round(side / 2)))
        for side in (target.width_px, target.height_px)
    )
    middle = target.x_px + (target.width_px - 1) / 2, target.y_px + (target.height_px - 1) / 2
    return ResolvedTarget(tangents=_tangents(wide, *middle), half_px=(half_x, half_y))


def _tangents(wide: Intrinsics, x_px: float, y_px: float) -> NDArray[np.float64]:
    return np.asarray(np.tan(wide.angles_rad([[x_px, y_px]])[0]), dtype=np.float64)


def _finite(*values: float, name: str) -> None:
    if not all(math.isfinite(v) for v in values):
        raise InvalidInput(f"{name} target {values}: finite numbers are needed; correct the request")
