"""Disparity advantage (Sec. 4.1): depth error of the foveae beside that of a wide pair of equal baseline.

|dZ| = Z² / (B f) |dd|. Measured errors of matching, dd, are passed in; each states its source.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter, ScalarFormatter

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.geometry.triangulate import depth_sigma_m
from foveacam_pipeline.study.report.findings import (
    PaperComparison,
    StudyFigure,
    StudyResult,
    Value,
    drawing_of,
)

WIDE_PX_PER_DEG = 55.0  # Table 2
FOVEA_PX_PER_DEG = 502.0  # Table 2
BASELINE_M = 0.2  # between the foveae; the wide pair has the same (Sec. 4.1)
RAIL_M = (5.0, 10.0, 15.0)  # Fig. 4
FINEST_PX = 1.0 / 256.0  # sub-pixel refinement of the paper's template matching (Sec. 4.1)
COLOURS = {"wide": "#D55E00", "fovea": "#0072B2"}
LINES = ("-", "--", ":", "-.", (0, (7, 2, 1, 2, 1, 2)), (0, (1, 4)), (0, (10, 3)))
"""One line style for each error of matching."""
NEAREST_M, FARTHEST_M = 2.0, 40.0


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchingError:
    """An error of matching, px of the camera that matches; `label` names it on plots, `key` in values.

    `source`: how it was measured; empty for one that is assumed.
    """

    key: str
    label: str
    error_px: float
    source: str = ""

    def __post_init__(self) -> None:
        """Refuse an error that is not above 0 px."""
        if not 0.0 < self.error_px < math.inf:
            raise InvalidInput(f"a matching error of {self.error_px} px was given; it must exceed 0 px")


ASSUMED = (
    MatchingError(key="1px", label="1 px", error_px=1.0),
    MatchingError(key="finest", label="1/256 px (the paper's refinement)", error_px=FINEST_PX),
)


def focal_px(px_per_deg: float) -> float:
    """Return the focal length, px, of a pinhole with that resolution on its axis: x = f tan(a), dx/da = f."""
    if not 0.0 < px_per_deg < math.inf:
        raise InvalidInput(f"{px_per_deg} px per degree were given; a camera resolves more than 0")
    return math.degrees(px_per_deg)


def measured_error(key: str, error_px: float, *, whose: str, source: str) -> MatchingError:
    """Return a measured error; its label has its size. Raise InvalidInput unless it is above 0 px."""
    return MatchingError(key=key, label=f"{error_px:.3g} px ({whose})", error_px=error_px, source=source)


def depth_error_study(measured: Sequence[MatchingError] = ()) -> StudyResult:
    """Return the study of Sec. 4.1, for assumed errors of matching and for measured ones.

    Raise InvalidInput as `check_distinct`.
    """
    errors = (*ASSUMED, *check_distinct(measured))
    return StudyResult(
        name="depth",
        section="4.1",
        title="Disparity advantage in triangulation",
        values=_values(errors),
        rows=_rows(errors),
        pictures=(_picture(errors),),
        definitions=(
            "|dZ| = Z² / (B f) |dd|: the depth error along z that a matching error dd makes, dd in pixels of "
            "the camera that matches.",
            f"B = {BASELINE_M:g} m for both pairs. f in px is the resolution on the axis, px per degree, "
            f"times 180/π (Table 2): {focal_px(WIDE_PX_PER_DEG):.0f} px wide, "
            f"{focal_px(FOVEA_PX_PER_DEG):.0f} px fovea.",
        ),
        deviations=_deviations(measured),
    )


def check_distinct(measured: Sequence[MatchingError]) -> tuple[MatchingError, ...]:
    """Return the measured errors; raise InvalidInput for a key given twice or too many errors to draw."""
    keys = [each.key for each in measured]
    twice = sorted({key for key in keys if keys.count(key) > 1})
    if twice:
        raise InvalidInput(f"the matching error {', '.join(twice)} was given twice; give it once")
    most = len(LINES) - len(ASSUMED)
    if len(measured) > most:
        raise InvalidInput(f"{len(measured)} matching errors were given; give {most} at most")
    return tuple(measured)


def error_m(distance_m: float, px_per_deg: float, *, error_px: float) -> float:
    """Return |dZ|, m, at a distance (Sec. 4.1)."""
    return float(depth_sigma_m(distance_m, error_px, f_px=focal_px(px_per_deg), baseline_m=BASELINE_M))


def disparity_px(distance_m: float, px_per_deg: float) -> float:
    """Return the disparity, px, of a point at that distance."""
    return focal_px(px_per_deg) * BASELINE_M / distance_m


def _values(errors: Sequence[MatchingError]) -> dict[str, Value]:
    found: dict[str, Value] = {
        "baseline_m": BASELINE_M,
        "wide_f_px": focal_px(WIDE_PX_PER_DEG),
        "fovea_f_px": focal_px(FOVEA_PX_PER_DEG),
        **{f"matching_error_{each.key}_px": each.error_px for each in errors},
    }
    for z_m in RAIL_M:
        found[f"error_ratio_{z_m:.0f}m"] = error_m(z_m, WIDE_PX_PER_DEG, error_px=1.0) / error_m(
            z_m, FOVEA_PX_PER_DEG, error_px=1.0
        )
        for camera, density in (("wide", WIDE_PX_PER_DEG), ("fovea", FOVEA_PX_PER_DEG)):
            found[f"{camera}_disparity_{z_m:.0f}m_px"] = disparity_px(z_m, density)
            for each in errors:
                found[f"{camera}_error_{each.key}_{z_m:.0f}m_m"] = error_m(
                    z_m, density, error_px=each.error_px
                )
    return found


def _rows(errors: Sequence[MatchingError]) -> tuple[PaperComparison, ...]:
    ratio = FOVEA_PX_PER_DEG / WIDE_PX_PER_DEG
    rows = [
        PaperComparison(
            quantity="resolution of fovea over wide, hence wide error over fovea error",
            paper="~9×",
            ours=f"{ratio:.2f}× at {_list(RAIL_M, 'm')}",
            note="the same at every distance: Z² and B cancel",
        ),
        PaperComparison(
            quantity=f"disparity at {_list(RAIL_M, 'm')}",
            paper="wide compresses towards quantised values at 10 m, reaches the noise floor at 15 m",
            ours=f"wide {_disparities(WIDE_PX_PER_DEG)}, fovea {_disparities(FOVEA_PX_PER_DEG)}",
            note="the law alone does not let the wide pair fail at 15 m: "
            "what fails there is matching a target of few pixels",
        ),
    ]
    for each in errors:
        rows.append(
            PaperComparison(
                quantity=f"depth error at {_list(RAIL_M, 'm')} for |dd| = {each.label}",
                paper="Fig. 4(c), curves only",
                ours=f"wide {_errors(WIDE_PX_PER_DEG, each)}, fovea {_errors(FOVEA_PX_PER_DEG, each)}",
                note=each.source or "assumed",
            )
        )
    return tuple(rows)


def _deviations(measured: Sequence[MatchingError]) -> tuple[str, ...]:
    notes = [
        "The paper measures the wide pair by a camera on a linear stage; here both curves are the law "
        "itself, with Table 2's resolutions. The study `localisation` measures both pairs."
    ]
    if not measured:
        notes.append(
            "No measured matching error was given: measure one with `foveacam bench verge --json` or "
            "`foveacam bench stereo --json`."
        )
        return tuple(notes)
    notes.append(
        "The source of each measured error is given beside its row. Wide curves suppose that a wide pair "
        "matches to the same fraction of its own pixel."
    )
    return tuple(notes)


def _list(numbers: Sequence[float], unit: str, form: str = "g") -> str:
    return "/".join(f"{number:{form}}" for number in numbers) + f" {unit}"


def _disparities(px_per_deg: float) -> str:
    return _list([disparity_px(z_m, px_per_deg) for z_m in RAIL_M], "px", ".0f")


def _errors(px_per_deg: float, matching: MatchingError) -> str:
    errors_mm = [1e3 * error_m(z_m, px_per_deg, error_px=matching.error_px) for z_m in RAIL_M]
    return _list(errors_mm, "mm", ".3g")


def _picture(errors: Sequence[MatchingError]) -> StudyFigure:
    return StudyFigure(
        name="depth-error",
        title="Depth error of wide and fovea stereo",
        caption="The law of Sec. 4.1 with Table 2's values: at every distance the fovea errs "
        f"{FOVEA_PX_PER_DEG / WIDE_PX_PER_DEG:.2f} times less for the same matching error in its own pixels. "
        f"{_origins(errors)}",
        drawing=drawing_of(drawing(errors)),
        figure="Fig. 4(c)",
    )


def _origins(errors: Sequence[MatchingError]) -> str:
    """Return which lines are of assumed errors of matching, and which of measured ones."""
    if any(each.source for each in errors):
        return "Thick lines: |dd| measured or given, as the remarks above say; thin: assumed."
    return "All matching errors are assumed, none is measured."


def drawing(errors: Sequence[MatchingError]) -> Figure:
    """Draw |dZ| against Z for both cameras and each error of matching; measured ones are thick."""
    figure = Figure(figsize=(8.0, 5.6), layout="constrained")
    axes = figure.subplots()
    z_m = np.geomspace(NEAREST_M, FARTHEST_M, 100)
    for camera, density in (("fovea", FOVEA_PX_PER_DEG), ("wide", WIDE_PX_PER_DEG)):
        for each, line in zip(errors, LINES, strict=False):
            sigma_m = depth_sigma_m(z_m, each.error_px, f_px=focal_px(density), baseline_m=BASELINE_M)
            axes.plot(z_m, 1e3 * sigma_m, linestyle=line, color=COLOURS[camera], linewidth=_width(each))
    _dress(figure, axes, errors)
    return figure


def _width(error: MatchingError) -> float:
    return 2.2 if error.source else 1.2


def _dress(figure: Figure, axes: Axes, errors: Sequence[MatchingError]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("depth Z, m")
    axes.set_ylabel("depth error |dZ|, mm")
    for z_m in RAIL_M:
        axes.axvline(z_m, color="0.7", linewidth=0.8, zorder=0)
    axes.set_xticks([2.0, 3.0, *RAIL_M, 20.0, 30.0, 40.0])
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.grid(visible=True, axis="y", alpha=0.3)
    axes.set_title(f"|dZ| = Z² / (B f) · |dd|, B = {BASELINE_M:g} m", fontsize=11)
    for camera, density in (("wide", WIDE_PX_PER_DEG), ("fovea", FOVEA_PX_PER_DEG)):
        label = f"{camera} pair, {density:.0f} px/°, f = {focal_px(density):.0f} px"
        axes.plot([], [], color=COLOURS[camera], linewidth=3.0, label=label)
    for each, line in zip(errors, LINES, strict=False):
        label = f"|dd| = {each.label}"
        axes.plot([], [], linestyle=line, color="0.3", linewidth=_width(each), label=label)
    figure.legend(fontsize=9, loc="outside lower center", ncols=2, handlelength=5.0)
