"""Check of the three pictures: which camera sends which, upright or not, sharp or not, alive or not."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.rig_under_test import EYES, RigUnderTest, frame_of, own_marker, shades_of
from foveacam_pipeline.accept.values import AcceptanceCheck, Fault, Measured, NamedFault, judged
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.markers import find_markers, middle_px

TITLE = "Pictures: which camera, which way up, alive"
FOCUS_TITLE = "Focus"
ZOOM_RATIO = 3.0
"""A fovea shows a marker about nine times as large as the wide camera."""
QUARTER_RAD = math.pi / 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenPicture:
    """What a camera's picture shows of the markers. `side_px`: of a marker; `turn_quarters`: clockwise."""

    nearest_id: int | None
    side_px: float
    mirrored: bool
    turn_quarters: int


def check_pictures(rig: RigUnderTest) -> tuple[AcceptanceCheck, Sighting]:
    """Return the result of two looks at rest at the markers, and the second look."""
    first, second = rig.look(), rig.look()
    frozen = [role for role in Role if _same(first, second, role)]
    seen = {role: _read(second, role, rig.layout) for role in Role if role not in frozen}
    findings = [
        NamedFault(
            fault=Fault.FROZEN_PICTURE,
            subject=str(role),
            detail=f"two pictures of the {role} camera are equal to the last bit, though noise must differ",
        )
        for role in frozen
    ]
    if not frozen:
        findings += [*_unseen(seen, rig.layout), *_turned(seen), *_exchanged(seen, rig.layout)]
    figures = [
        Measured(name=f"{role}: side of a marker", value=round(picture.side_px, 1), unit="px")
        for role, picture in seen.items()
        if picture.nearest_id is not None
    ]
    return judged("pictures", TITLE, figures=figures, findings=findings, picture="pictures"), second


def check_focus(sighting: Sighting, layout: MarkerLayout, limits: AcceptanceLimits) -> AcceptanceCheck:
    """Return the blur of each camera by the edges of its marker."""
    figures, findings = [], []
    for role in Role:
        view = _sharpest_seen(sighting, role, layout)
        limit_px = limits.blur_wide_px if role is Role.WIDE else limits.blur_fovea_px
        figure = Measured(
            name=f"{role}: blur of edges, sigma", value=round(view.blur_px, 3), unit="px", high=limit_px
        )
        figures.append(figure)
        if not figure.is_within:
            detail = (
                f"edges in the {role} picture spread by {view.blur_px:.2f} px (sigma), at most {limit_px:g}"
            )
            findings.append(NamedFault(fault=Fault.DEFOCUS, subject=str(role), detail=detail))
    return judged("focus", FOCUS_TITLE, figures=figures, findings=findings, picture="pictures")


def _sharpest_seen(sighting: Sighting, role: Role, layout: MarkerLayout) -> MarkerView:
    """Return a fovea's own marker; of the wide camera, whose blurred markers may not all read, any one."""
    frame = frame_of(sighting, role)
    if role is not Role.WIDE:
        return own_marker(frame, layout)
    views = find_markers(shades_of(frame), side_m=layout.side_m, only=layout.ids, binning=frame.binning)
    if not views:
        return own_marker(frame, layout)  # raises
    return min(views.values(), key=lambda view: view.blur_px)


def _same(first: Sighting, second: Sighting, role: Role) -> bool:
    one, two = frame_of(first, role), frame_of(second, role)
    return one.seq != two.seq and bool(np.array_equal(one.image, two.image))


def _read(sighting: Sighting, role: Role, layout: MarkerLayout) -> SeenPicture:
    frame = frame_of(sighting, role)
    shades = shades_of(frame)
    for mirrored in (False, True):
        picture = np.ascontiguousarray(shades[:, ::-1]) if mirrored else shades
        for large in (True, False):
            markers = find_markers(
                picture, side_m=layout.side_m, large=large, only=layout.ids, binning=frame.binning
            )
            if markers:
                return _described(markers, picture.shape, binning=frame.binning, mirrored=mirrored)
    return SeenPicture(nearest_id=None, side_px=0.0, mirrored=False, turn_quarters=0)


def _described(
    markers: dict[int, MarkerView], shape: tuple[int, ...], *, binning: int, mirrored: bool
) -> SeenPicture:
    centre_px = binning * np.array([shape[1], shape[0]]) / 2.0
    nearest = min(markers, key=lambda each: float(np.linalg.norm(middle_px(markers[each]) - centre_px)))
    view = markers[nearest]
    side = _side_px(view)
    return SeenPicture(
        nearest_id=nearest,
        side_px=float(np.linalg.norm(side)),
        mirrored=mirrored,
        turn_quarters=round(math.atan2(side[1], side[0]) / QUARTER_RAD) % 4,
    )


def _side_px(view: MarkerView) -> NDArray[np.float64]:
    """Return the vector (2,) along the upper side of a marker, from its own left to its own right, px."""
    across = np.linalg.lstsq(
        np.column_stack([view.places_m, np.ones(len(view.places_m))]), view.corners_px, rcond=None
    )[0][0]
    side_m = 2.0 * float(np.abs(view.places_m).max())
    return np.asarray(across * side_m, dtype=np.float64)


def _unseen(seen: dict[Role, SeenPicture], layout: MarkerLayout) -> list[NamedFault]:
    return [
        NamedFault(
            fault=Fault.MARKER_NOT_SEEN,
            subject=str(role),
            detail=f"the {role} picture shows none of the markers {', '.join(map(str, layout.ids))}",
        )
        for role, picture in seen.items()
        if picture.nearest_id is None
    ]


def _turned(seen: dict[Role, SeenPicture]) -> list[NamedFault]:
    found = []
    for role, picture in seen.items():
        if picture.mirrored:
            detail = f"the {role} picture is reversed from left to right: its marker reads in a mirror only"
            found.append(NamedFault(fault=Fault.MIRRORED_PICTURE, subject=str(role), detail=detail))
        if picture.turn_quarters:
            turned_deg = 90 * picture.turn_quarters
            detail = f"the {role} picture is rotated by {turned_deg} degrees against its marker"
            found.append(NamedFault(fault=Fault.ROTATED_PICTURE, subject=str(role), detail=detail))
    return found


def _exchanged(seen: dict[Role, SeenPicture], layout: MarkerLayout) -> list[NamedFault]:
    """Return which cameras send each other's pictures, or which fovea looks at another's marker."""
    if any(picture.nearest_id is None for picture in seen.values()):
        return []
    shown = {role: _shown(picture, seen, layout) for role, picture in seen.items()}
    pairs = {tuple(sorted((str(role), str(other)))) for role, other in shown.items() if other is not role}
    if not pairs:
        return []
    if sorted(shown.values()) != sorted(Role):
        return [
            NamedFault(
                fault=Fault.MARKER_NOT_SEEN,
                subject=str(role),
                detail=f"the {role} fovea looks at the {other} camera's marker, not at its own",
            )
            for role, other in shown.items()
            if other is not role and role in EYES
        ]
    return [
        NamedFault(
            fault=Fault.EXCHANGED_CAMERAS,
            subject=f"{one} and {two}",
            detail=f"the picture that arrives as {one} is the {two} camera's, and the other way round",
        )
        for one, two in sorted(pairs)
    ]


def _shown(picture: SeenPicture, seen: dict[Role, SeenPicture], layout: MarkerLayout) -> Role:
    """Return the camera that made a picture, by its zoom and by the marker in its middle."""
    largest_px = max(each.side_px for each in seen.values())
    if picture.side_px * ZOOM_RATIO < largest_px:
        return Role.WIDE
    known = None if picture.nearest_id is None else layout.role_of(picture.nearest_id)
    return known if known is not None else Role.WIDE
