"""Sentences for the operator: why a fixation ended as it did, and what would help."""

import math
from collections.abc import Mapping

from foveacam_hardware.contract import Role
from foveacam_pipeline.verge.distance import LocatedPoint
from foveacam_pipeline.verge.looking.fixation_head import FixationEnded
from foveacam_pipeline.verge.matching.fine import FineMatch
from foveacam_pipeline.verge.matching.target_offset import TargetOffset
from foveacam_pipeline.verge.measure import Measurement
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.values import DistanceBound, EyeView, FixationState

NEAR_ENOUGH = 1.6
"""The last look of a complete search is at most this many times farther than `nearest_m`."""


def verged(point: LocatedPoint, fine: FineMatch) -> str:
    """Return the sentence of a fixation that verged."""
    return (
        f"Verged at {point.distance_m:.3f} m ± {1e3 * point.distance_sigma_m:.1f} mm, left and right agree "
        f"to {max(abs(fine.residual_x_px), abs(fine.residual_y_px)):.2f} px."
    )


COARSE_SIGMA_M = 0.1
"""Errors from this size on are stated in metres, smaller ones in millimetres."""
CANNOT_TURN = "This eye cannot turn that far; it looks as near as it can."
NO_CAMERA = "The camera of this eye is not there; check its cable and power."
HIDDEN = "Something nearer hides the target from this eye."
WHY_NOT = {CANNOT_TURN: "cannot turn that far", NO_CAMERA: "has no camera: check its cable and power"}
UNSUPPORTED = (
    "Left and right agree on something beside the point, which itself shows something else or no texture."
)


def camera_gone(role: Role) -> FixationEnded:
    """Return the failure of a loop of which one eye has no camera."""
    return FixationEnded(
        FixationState.LOST,
        f"The {role} camera is not there; check its cable and power.",
        missing=role,
    )


def one_eyed(point: LocatedPoint, roles: set[Role], views: Mapping[Role, EyeView]) -> str:
    """Return the sentence of an answer by a fovea and the wide camera.

    `roles`: the foveae that were matched. `views`: what each eye shows now; an eye that shows nothing of the
    target is not named as one that sees it, so that the sentence agrees with the views.
    """
    found = _distance_words(point)
    roles = {role for role in roles if views[role].sees_target} or roles
    if len(roles) == 2:
        return (
            f"{found} by each fovea against the wide view; left and right do not match at the point itself."
        )
    (seeing,) = roles
    other = Role.RIGHT if seeing is Role.LEFT else Role.LEFT
    why = WHY_NOT.get(views[other].reason, "does not see it: something hides it")
    return f"{found} by the {seeing} fovea and the wide camera; the {other} eye {why}."


def inferred(point: LocatedPoint, *, samples: int, alternatives: int) -> str:
    """Return the sentence of an answer inferred from what surrounds the point."""
    return (
        f"{_distance_words(point)}, inferred from {_points(samples)} around it: the point itself "
        f"has no texture to match{_choice(alternatives)}."
    )


def _points(count: int) -> str:
    return "one measured point" if count == 1 else f"{count} measured points"


def _choice(alternatives: int) -> str:
    return f"; {alternatives} distances are possible: choose one" if alternatives else ""


def _distance_words(point: LocatedPoint) -> str:
    """Return a distance and its error, in units that suit the error."""
    if point.distance_sigma_m >= COARSE_SIGMA_M:
        return f"{point.distance_m:.1f} m ± {point.distance_sigma_m:.1f} m"
    return f"{point.distance_m:.3f} m ± {1e3 * point.distance_sigma_m:.0f} mm"


def bounded(bound: DistanceBound, ended: FixationEnded, *, alternatives: int) -> str:
    """Return the sentence of an answer that only limits the distance."""
    far = f", nearer than {bound.farthest_m:.1f} m" if math.isfinite(bound.farthest_m) else ""
    return f"Farther than {bound.nearest_m:.1f} m{far}{_choice(alternatives)}. {ended.reason}"


def moved_away() -> FixationEnded:
    """Return the failure at a target that is neither where it was nor where its track leads."""
    return FixationEnded(
        FixationState.LOST,
        "What was clicked moved away, or something hid it, during the measurement; click it again.",
    )


def blank_patch() -> FixationEnded:
    """Return the failure at a patch of the wide image that shows nothing but noise."""
    return FixationEnded(
        FixationState.NO_TEXTURE,
        "The wide image shows no texture there, only noise; choose a point on a pattern or an edge, or draw "
        "a rectangle that holds one.",
    )


def not_found(limits: VergeSettings, *, nearest_m: float) -> FixationEnded:
    """Return the failure of a search that found nothing; `nearest_m`: depth of its last look."""
    if nearest_m > NEAR_ENOUGH * limits.nearest_m:
        return FixationEnded(
            FixationState.OUT_OF_RANGE,
            f"Not found from infinity to {nearest_m:.2f} m, and an eye cannot turn further in: for something "
            "nearer choose a point closer to the middle of the wide view.",
        )
    return FixationEnded(
        FixationState.LOST,
        f"Not found in both foveae between {limits.nearest_m:g} m and infinity: it may be hidden from one "
        "eye, nearer, moving, or one of many alike; choose a point beside it or a larger rectangle.",
    )


def elsewhere(target_offset: TargetOffset) -> FixationEnded:
    """Return the failure at a target that both eyes show far from its place."""
    return FixationEnded(
        FixationState.LOST,
        "Both foveae show it, but not where the calibration expects it: "
        f"{abs(target_offset.across_px):.0f} px across, {abs(target_offset.down_px):.0f} px up or down, "
        f"{abs(target_offset.rows_px):.0f} px apart in height. The mounts may have moved: measure the drift "
        "and correct it.",
        target_offset=target_offset,
    )


def many_alike(places: int) -> FixationEnded:
    """Return the failure at a repeated pattern, which fits at several distances."""
    return FixationEnded(
        FixationState.LOST,
        f"The pattern repeats: {places} distances fit equally well; draw a rectangle that holds its "
        "edge or a flaw, or choose a point beside it.",
    )


def neighbour(side: str, *, aside_px: float) -> FixationEnded:
    """Return the failure at a look-alike: one eye's view fits better `aside_px` wide px aside."""
    return FixationEnded(
        FixationState.LOST,
        f"The {side} eye sees a look-alike {abs(aside_px):.0f} px beside the target, which may be hidden "
        "from it; choose a point that both eyes can see, or draw a larger rectangle.",
    )


def doubt(found: Measurement, limits: VergeSettings) -> FixationEnded | None:
    """Return why a look cannot be trusted, or None when its measurements are good and agree."""
    if found.quality(limits) >= 0.0:
        return None
    if found.wide_peak < limits.confirm_score:
        return FixationEnded(
            FixationState.LOST,
            f"The target left the foveae or is hidden from one (correlation {found.wide_peak:.2f} with the "
            "wide view); try again, or choose a point beside it.",
        )
    precise = found.fine.sigma_x_px <= limits.largest_sigma_px(found.fine.score)
    alike = limits.fine_score if precise else limits.grain_score
    if found.fine.score < alike and found.fine.contrast >= limits.contrast:
        return FixationEnded(
            FixationState.LOST,
            f"Left and right do not show the same there (correlation {found.fine.score:.2f}): it may be "
            "hidden from the left or the right eye; choose a point beside it that both can see.",
        )
    if found.fine.score >= limits.fine_score and not precise:
        return FixationEnded(
            FixationState.NO_TEXTURE,
            "The texture there does not determine a distance: it runs from side to side, along the line "
            "between the eyes, or changes too slowly; choose a point where something crosses it.",
        )
    if found.fine.score < limits.fine_score:
        return FixationEnded(
            FixationState.NO_TEXTURE,
            f"The point itself shows no texture to match (correlation {found.fine.score:.2f} between the "
            "foveae), though its surroundings do; choose a point on the pattern.",
        )
    return another(found)


def rows_differ(found: Measurement) -> FixationEnded:
    """Return the failure at a match in different rows of the two eyes: one point has the same row in both."""
    return FixationEnded(
        FixationState.LOST,
        f"Left and right agree only {abs(found.fine.residual_y_px):.1f} px apart in height, so not on the "
        "same point; choose a point beside it that both can see.",
    )


def another(found: Measurement) -> FixationEnded:
    """Return the failure at a match that shows something else than the wide view does."""
    return FixationEnded(
        FixationState.LOST,
        f"Left and right agree on another place than the wide view (correlation {found.wide_score:.2f} "
        "there): the pattern may repeat, or a near edge covers it; draw a larger rectangle.",
    )
