"""The plan that a command line means: a file, or a grid from options."""

import json
from collections.abc import Mapping
from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.plan import RasterPlan, plan_from


def plan_of(
    path: Path | None, options: Mapping[str, object], *, begun: str | None = None
) -> RasterPlan | None:
    """Return the plan of a file or of options, not of both.

    `begun`: the option that is about a capture with a plan of its own, such as --resume; then None.
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
    return plan_from(_document(path), what=str(path))


def _document(path: Path) -> object:
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
