"""Parses the plan (file or options) of `foveacam capture`, and formats the lines that it prints."""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset import ImageCodec
from foveacam_pipeline.capture.plan import RasterPlan, plan_from
from foveacam_server.resources.capturing.captures.schema import CaptureDocument, EstimateDocument

if TYPE_CHECKING:
    from foveacam_client import models

INTERRUPTED = 130


def plan_of(
    path: Path | None, options: Mapping[str, object], *, begun: str | None = None
) -> RasterPlan | None:
    """Return the plan of a file or of options; raise for both together.

    `begun`: the option for an existing capture with its own plan, such as --resume; then return None.
    """
    if begun is not None:
        if path is not None or options:
            raise InvalidInput(f"{begun}: a capture has its own plan; leave plan and options out")
        return None
    if path is None:
        points = options.get("points")
        grid = {"kind": "grid", **points} if isinstance(points, dict) else {"kind": "grid"}
        return plan_from({**options, "points": grid}, what="options of the plan")
    if options:
        raise InvalidInput(f"{path}: a plan was given and options of one too; write them into the plan")
    return plan_from(_read_plan(path), what=str(path))


def _read_plan(path: Path) -> object:
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InvalidInput(
            f"{path}: it cannot be read ({error.strerror}); give a plan (.json) or set points"
        ) from error
    except UnicodeDecodeError as error:
        raise InvalidInput(f"{path}: it is no text ({error}); give a plan (.json) or set points") from error
    if path.suffix.lower() != ".json":
        return {"points": {"kind": "set_points", "points": text}}
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"{path}: it is no JSON ({error}); correct it") from error


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureOrder:
    """The capture to make. `plan`: None resumes the capture of that name."""

    name: str
    plan: RasterPlan | None
    label: str = ""
    codec: ImageCodec = ImageCodec.TIFF
    estimate: bool = False


AnyEstimate: TypeAlias = "EstimateDocument | models.EstimateDocument"


def estimate_words(found: AnyEstimate) -> str:
    """Return a line of text on a plan's time and size."""
    size = f"{found.stored_bytes / 1e6:.0f} MB of {found.free_bytes / 1e6:.0f} MB free"
    return (
        f"{found.points} points, {found.files} images:"
        f" {span_words(found.duration_low_s, found.duration_high_s)}, {size}; {_basis_words(found)}"
    )


def _basis_words(found: AnyEstimate) -> str:
    words = []
    if found.preparing_fixations:
        span = span_words(found.preparing_low_s, found.preparing_high_s)
        words.append(f"{span} of it to measure the scene's distance by {found.preparing_fixations} fixations")
    if found.hand_moves:
        words.append(f"without {found.hand_moves} moves by hand")
    captures = "capture" if found.timed_captures == 1 else f"{found.timed_captures} captures"
    timed = f"by the times of this rig's last {captures}"
    words.append(timed if found.timed_captures else "assumed until a capture of this rig was timed")
    return ", ".join(words)


def span_words(low_s: float, high_s: float) -> str:
    """Return a range of time in the unit that suits its upper end, rounded outwards, such as "12 to 25 s"."""
    unit, unit_s = ("s", 1.0) if high_s < 90.0 else ("min", 60.0) if high_s < 5400.0 else ("h", 3600.0)
    fine = 1 if high_s < 10.0 * unit_s else 0
    low = _rounded(math.floor, low_s / unit_s, max(fine, int(low_s < unit_s)))
    high = _rounded(math.ceil, high_s / unit_s, fine)
    return f"{high} {unit}" if low == high else f"{low} to {high} {unit}"


def _rounded(towards: Callable[[float], int], value: float, digits: int) -> str:
    """Return a number with so many decimals, rounded by `towards`; an error of division rounds nothing."""
    steps = 10.0**digits
    return f"{towards(round(value * steps, 6)) / steps:.{digits}f}"


def codec_of(text: str) -> ImageCodec:
    """Return the image codec of `--codec`; raise `InvalidInput` for another word."""
    try:
        return ImageCodec(text)
    except ValueError as error:
        raise InvalidInput(f"--codec {text}: images are kept as tiff or png; choose one") from error


def capture_words(found: "CaptureDocument | models.CaptureDocument") -> str:
    """Return a line of text on a capture's state and size."""
    points = found.points
    return (
        f"{found.folder}: {found.state}, {points.taken} of {points.planned} points,"
        f" {found.size_bytes / 1e6:.0f} MB"
    )
