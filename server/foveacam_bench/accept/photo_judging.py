"""Calibrates the camera of a folder of photographs as `foveacam calibrate wide --images` does, and judges it.

A fit is compared with the camera that is known; a refusal with the words that it must contain.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.accept.photo_pictures import KnownCamera
from foveacam_hardware.contract import FoveaError, OutOfRange
from foveacam_pipeline.calibrate.wide.wide_images import LeftOutImage
from foveacam_pipeline.models import Intrinsics
from foveacam_server.resources.calibrating.sessions.options import WideOptions
from foveacam_server.resources.calibrating.sessions.schema import WideFitDocument
from foveacam_server.resources.calibrating.sessions.sessions import SessionCollection
from foveacam_server.resources.calibrating.sessions.step_environment import SilentStepWatcher
from foveacam_server.resources.calibrating.sessions.steps import measure_on_images
from foveacam_server.resources.calibrating.sessions.wide_stage import RESULT
from foveacam_server.resources.calibrating.sessions.wide_step import ImageFolder

ROUND_TRIP_PX = 0.02
"""Largest error of pixel to angle to pixel where the lens states a direction."""
GRID = (161, 121)
"""Pixels across and down, from edge to edge, at which a lens is tried."""
FOLD_MARGIN = 0.05
"""Relative doubt of the radius at which a fitted lens folds back: no view has corners there."""
FOCAL_TOLERANCE = 0.002
"""Largest relative error of a focal length. Corners to 0.02 px in 16 views leave 0.0003; the product refuses
views that leave more than 0.005."""
WHOLE = 0.995
"""Least share of the picture with directions, by a lens that reaches the corners."""
SAME = 1e-9
"""Relative difference of two fits of the same pixels."""
COMPARABLE = 1.25
"""Largest residual of a fit over that of the same views in 8 bits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetOutcome:
    """What became of a set: `lenses`, the chosen one first, or `refusal`, the message, or `crash`."""

    lenses: tuple[Intrinsics, ...] = ()
    rms_px: float = 0.0
    views: int = 0
    left_out: Mapping[str, str] = field(default_factory=dict)
    refusal: str = ""
    crash: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fits:
    """A set that is to fit `camera`.

    `views`: least number that is used. `known`: least share of the picture with directions, of a camera that
    reaches all of it. `left_out`: listed files, with words of the reason. `same_as`, `comparable_to`: an
    earlier set with the same lens, or with such residuals. `published`: the camera is known by its
    publisher's fit alone.
    """

    camera: KnownCamera
    focal_tolerance: float = FOCAL_TOLERANCE
    centre_tolerance: float = 0.005
    largest_rms_px: float = 0.25
    views: int = 14
    known: float = WHOLE
    left_out: Mapping[str, str] = field(default_factory=dict)
    same_as: str = ""
    comparable_to: str = ""
    published: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Refused:
    """A set that is to be refused: `words`, a regular expression that the message contains; `never`: not."""

    words: str
    never: str = r"$^"


Expected: TypeAlias = Fits | Refused


def calibrate_folder(folder: Path, options: WideOptions, *, pattern: str = "*") -> SetOutcome:
    """Return what the step for image files makes of a folder."""
    left_out: list[LeftOutImage] = []
    images = ImageFolder(folder=folder, pattern=pattern, left_out=left_out.extend)
    with TemporaryDirectory() as data:
        session = SessionCollection(Path(data)).create(label="photographs", rig_id="strange", baseline_m=0.2)
        try:
            measure_on_images(session, images, options, watch=SilentStepWatcher())
            found = session.read(RESULT)
        except FoveaError as error:
            return SetOutcome(refusal=str(error), left_out=_by_name(left_out))
        except Exception as error:  # noqa: BLE001 - what breaks on a set is counted, and the others follow
            return SetOutcome(crash=f"{type(error).__name__}: {error}", left_out=_by_name(left_out))
    if found is None or found.lens is None or found.wide.fit is None:
        return SetOutcome(crash="neither a lens nor a message", left_out=_by_name(left_out))
    other = found.wide.other_model
    lenses = (found.lens, *([] if other is None else [_lens_of(other, found.lens)]))
    return SetOutcome(
        lenses=lenses,
        rms_px=found.wide.fit.rms_px,
        views=len(found.wide.samples),
        left_out=_by_name(left_out),
    )


def fault_of(outcome: SetOutcome, expected: Expected, *, earlier: Mapping[str, SetOutcome]) -> str:
    """Return what is wrong with an outcome, in words; empty if nothing is."""
    if outcome.crash:
        return f"broke: {outcome.crash}"
    if isinstance(expected, Refused):
        if not outcome.refusal:
            return f"fitted {outcome.views} views, which should have been refused"
        right = re.search(expected.words, outcome.refusal) and not re.search(expected.never, outcome.refusal)
        return "" if right else f"refused for another reason: {outcome.refusal}"
    if outcome.refusal:
        return f"refused: {outcome.refusal}"
    return "; ".join(filter(None, (_lens_fault(outcome, expected), _views_fault(outcome, expected, earlier))))


def focal_error(lens: Intrinsics, camera: KnownCamera) -> float:
    """Return the larger relative error of the two focal lengths."""
    return float(np.abs(np.array([lens.fx_px, lens.fy_px]) / camera.focal_px - 1.0).max())


def round_trip_px(lens: Intrinsics) -> float:
    """Return the largest error of pixel to angle to pixel, px, where the lens states a direction.

    A direction without a pixel counts as the width of the picture.
    """
    pixels = _grid_px(lens.width, lens.height)
    angles = lens.angles_rad(pixels)
    known = np.isfinite(angles).all(axis=1)
    off_px = np.abs(lens.pixels(angles[known]) - pixels[known]).max(axis=1)
    return float(np.where(np.isfinite(off_px), off_px, lens.width).max(initial=0.0))


def field_fault(lens: Intrinsics, camera: KnownCamera, *, margin: float, known: float = WHOLE) -> str:
    """Return how the pixels with a direction differ from those that a camera reaches; empty if they agree.

    `margin`: relative doubt of the camera's fold; `known`: least share with directions where it has none.
    """
    pixels = _grid_px(lens.width, lens.height)
    there = np.isfinite(lens.angles_rad(pixels)).all(axis=1)
    reached = np.linalg.norm((pixels - camera.centre_px) / camera.focal_px, axis=1) / camera.reach
    if (reached < 1.0).all():
        return "" if there.mean() >= known else f"only {there.mean():.3f} of the picture has directions"
    missing, false = (~there & (reached < 1.0 - margin)).sum(), (there & (reached > 1.0 + margin)).sum()
    if missing or false:
        return f"{missing} pixels inside the fold have no direction, {false} beyond it have one"
    return "" if not there.all() and _is_refused(lens, pixels[~there][0]) else "a pixel beyond is not refused"


def _is_refused(lens: Intrinsics, pixel: NDArray[np.float64]) -> bool:
    try:
        lens.check_pixel(float(pixel[0]), float(pixel[1]))
    except OutOfRange:
        return True
    return False


def _lens_fault(outcome: SetOutcome, expected: Fits) -> str:
    """Return how the chosen lens differs from the camera."""
    lens, camera = outcome.lenses[0], expected.camera
    faults = []
    if (off := focal_error(lens, camera)) > expected.focal_tolerance:
        faults.append(f"the focal length is off by {100.0 * off:.2f} %")
    off_px = np.abs(np.array([lens.cx_px, lens.cy_px]) - camera.centre_px).max()
    if off_px > expected.centre_tolerance * camera.width:
        faults.append(f"the centre is off by {off_px:.1f} px")
    if outcome.rms_px > expected.largest_rms_px:
        faults.append(f"the residual is {outcome.rms_px:.3f} px")
    if (worst_px := max(round_trip_px(one) for one in outcome.lenses)) > ROUND_TRIP_PX:
        faults.append(f"pixels come back {worst_px:.3f} px off")
    fault = field_fault(lens, camera, margin=FOLD_MARGIN, known=expected.known)
    return "; ".join((*faults, *filter(None, [fault])))


def _views_fault(outcome: SetOutcome, expected: Fits, earlier: Mapping[str, SetOutcome]) -> str:
    """Return what is wrong with the views used and left out, and with the fit beside an earlier one's."""
    faults = []
    if outcome.views < expected.views:
        reasons = "; ".join(sorted(set(outcome.left_out.values()) or {"without a reason"}))
        faults.append(f"only {outcome.views} views were used: {reasons}")
    for name, words in expected.left_out.items():
        if not re.search(words, outcome.left_out.get(name, "")):
            faults.append(f"{name}: listed with {outcome.left_out.get(name)!r}, not with {words!r}")
    if expected.same_as and not _are_same(outcome.lenses[0], earlier[expected.same_as].lenses[0]):
        faults.append(f"the lens is another than of {expected.same_as}")
    if expected.comparable_to:
        before_px = earlier[expected.comparable_to].rms_px
        if outcome.rms_px > COMPARABLE * before_px:
            faults.append(f"the residual is {outcome.rms_px:.3f} px against {before_px:.3f} px in 8 bits")
    return "; ".join(faults)


def _are_same(lens: Intrinsics, other: Intrinsics) -> bool:
    return (lens.width, lens.height) == (other.width, other.height) and np.allclose(
        lens.matrix, other.matrix, rtol=SAME, atol=0.0
    )


def _grid_px(width: int, height: int) -> NDArray[np.float64]:
    """Return (n, 2) pixels over a picture, from edge to edge."""
    x, y = np.meshgrid(np.linspace(-0.5, width - 0.5, GRID[0]), np.linspace(-0.5, height - 0.5, GRID[1]))
    return np.column_stack([x.ravel(), y.ravel()])


def _lens_of(fit: WideFitDocument, like: Intrinsics) -> Intrinsics:
    """Return the lens of a fit's document, for pictures of the size of another lens's."""
    return Intrinsics(
        width=like.width,
        height=like.height,
        fx_px=fit.fx_px,
        fy_px=fit.fy_px,
        cx_px=fit.cx_px,
        cy_px=fit.cy_px,
        distortion=tuple(fit.distortion),
    )


def _by_name(images: list[LeftOutImage]) -> dict[str, str]:
    return {image.name: image.reason for image in images}
