"""Parse errors of matching for the study of Sec. 4.1: a number of px, or the JSON file of a bench."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.tradeoff.depth_error import MatchingError, measured_error

VERGE, VERGED = "verge", "verged foveae, simulated rig"
_REMEDY = "write one by `foveacam bench stereo --json > FILE`"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Measured:
    """A bench's figure that is an error of matching: its key, and how it is measured."""

    figure: str
    key: str
    whose: str
    source: str


KNOWN = (
    _Measured(
        figure="residual_median_px",
        key=VERGE,
        whose=VERGED,
        source="foveacam bench verge: median true left-right residual of clicks on texture that verged",
    ),
    _Measured(
        figure="rendered_median_error_px",
        key="rendered",
        whose="dense stereo of rendered foveae",
        source="foveacam bench stereo: median over pixels, against the renderer's exact depth",
    ),
    _Measured(
        figure="epe_px",
        key="stereo",
        whose="dense stereo of a real pair, mean",
        source="foveacam bench stereo: mean over pixels of the Motorcycle pair (Middlebury 2014), gross "
        "errors included, px of its own camera",
    ),
    _Measured(
        figure="disparity_noise_rms_px",
        key="render",
        whose="correlation of rendered views with noise",
        source="foveacam bench render: rms over points of a panel, with blur, noise and 8 bits",
    ),
)


def parse_matching_error(given: str) -> tuple[MatchingError, ...]:
    """Return the errors of matching given by a number of px or by the path of a bench's JSON file.

    Raise InvalidInput for what is neither, and for an error that is not above 0 px.
    """
    try:
        error_px = float(given)
    except ValueError:
        return _of_file(Path(given))
    return (
        measured_error(
            "given",
            error_px,
            whose="as given",
            source="given as a number; its source is not known here",
        ),
    )


def _of_file(path: Path) -> tuple[MatchingError, ...]:
    figures = _figures(path)
    found = tuple(
        measured_error(each.key, float(value), whose=each.whose, source=f"{each.source} ({path.name})")
        for each in KNOWN
        if isinstance(value := figures.get(each.figure), int | float)
    )
    if not found:
        names = ", ".join(each.figure for each in KNOWN)
        raise InvalidInput(f"{path} has no matching error; needed is one of {names}: {_REMEDY}")
    return found


def _figures(path: Path) -> Mapping[str, object]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InvalidInput(
            f"--matching-error {path}: neither a number of px nor a file of figures ({error}); {_REMEDY}"
        ) from error
    if not isinstance(found, dict):
        raise InvalidInput(f"{path} is no JSON object of figures; {_REMEDY}")
    return found
