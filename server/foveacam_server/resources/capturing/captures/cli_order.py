"""Parses the plan (file or options) of `foveacam capture`, and formats the lines that it prints."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

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


def estimate_words(found: "EstimateDocument | models.EstimateDocument") -> str:
    """Return a line of text on a plan's time and size."""
    return (
        f"{found.points} points, {found.files} images: at least {found.total_s:.1f} s,"
        f" {found.stored_bytes / 1e6:.0f} MB of {found.free_bytes / 1e6:.0f} MB free"
    )


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
