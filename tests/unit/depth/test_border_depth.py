"""The depth of a place on the border of a blank region, and whether what lies beyond it moves along."""

import math
from collections.abc import Callable
from functools import cache, partial

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_hardware.contract import Role
from foveacam_pipeline.verge.aim import aim_at
from foveacam_pipeline.verge.looking.fixation_head import FixationHead
from foveacam_pipeline.verge.matching.row_spectra import LookRows
from foveacam_pipeline.verge.matching.survey import ReducedEye, ReducedLook
from foveacam_pipeline.verge.matching.wide_patch import survey_f_px
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.surroundings import border_depth
from foveacam_pipeline.verge.surroundings.border_depth import RIM_PX, BorderDepth, BorderPlace, border_patch
from foveacam_pipeline.verge.surroundings.fine_edges import FineEdges
from foveacam_pipeline.verge.values import VergePhase

WIDE = CALIBRATION.wide
F_PX = survey_f_px(WIDE)
BASELINE_M = CALIBRATION.baseline_m
EDGE_TX = 0.004
PLACE = np.array([EDGE_TX, 0.0])
NEAR_PER_M, FAR_PER_M = 0.4, 0.15
GRID_PER_M = np.arange(0.0, 0.8, 0.5 / (0.5 * BASELINE_M * F_PX))
CELL_TAN = 2.0 / F_PX
BLANK = 150.0
FRAME_TAN = 0.012
FRAME_PER_M = FRAME_TAN / (0.5 * BASELINE_M)
"""So much nearer or farther a frame seems to an eye that takes its outer edge for its inner one."""
ROUGH = cv2.GaussianBlur(np.random.default_rng(7).normal(size=(400, 400)), (0, 0), 2.0)
NOISE = np.clip(60.0 + 14.0 * ROUGH / ROUGH.std(), 5.0, 115.0)


def _texture(tx: NDArray[np.float64], ty: NDArray[np.float64]) -> NDArray[np.float64]:
    columns, rows = ((np.rint(t / CELL_TAN).astype(int) + 150) % 400 for t in (tx, ty))
    return np.asarray(NOISE[rows, columns])


def _card_before_wall(tx: NDArray[np.float64], ty: NDArray[np.float64], shift: float) -> NDArray[np.float64]:
    """A blank card at the near depth to the left of its edge, a far wall with texture to the right."""
    wall = _texture(tx - shift * FAR_PER_M, ty)
    return np.where(tx - shift * NEAR_PER_M < EDGE_TX, BLANK, wall)


def _wall_behind_book(tx: NDArray[np.float64], ty: NDArray[np.float64], shift: float) -> NDArray[np.float64]:
    """A blank wall behind a near book with texture to the right of the edge."""
    across = tx - shift * NEAR_PER_M
    return np.where(across < EDGE_TX, BLANK, _texture(across, ty))


def _framed_board(tx: NDArray[np.float64], ty: NDArray[np.float64], shift: float) -> NDArray[np.float64]:
    """A blank board, its dark frame, and a wall as blank as the board, all as near."""
    across = tx - shift * FAR_PER_M
    return np.where((across < EDGE_TX) | (across > EDGE_TX + FRAME_TAN), BLANK, 60.0 + 0.0 * ty)


def _book_before_wall(tx: NDArray[np.float64], ty: NDArray[np.float64], shift: float) -> NDArray[np.float64]:
    """A far wall with texture, and a near book with another one to the right of the edge."""
    book = 255.0 - _texture(tx - shift * NEAR_PER_M, ty + FRAME_TAN)
    return np.where(tx - shift * NEAR_PER_M < EDGE_TX, _texture(tx - shift * FAR_PER_M, ty), book)


def _soft_wall_behind_book(
    tx: NDArray[np.float64], ty: NDArray[np.float64], shift: float, *, wall_per_m: float
) -> NDArray[np.float64]:
    """A wall with blurred texture, and a book that is nearer by a tenth to the right of the edge."""
    across = tx - shift * 1.1 * wall_per_m
    wall = cv2.GaussianBlur(_texture(tx - shift * wall_per_m, ty), (0, 0), 1.0)
    return np.where(across < EDGE_TX, wall, 255.0 - _texture(across, ty + FRAME_TAN))


def _book_before_fence(tx: NDArray[np.float64], ty: NDArray[np.float64], shift: float) -> NDArray[np.float64]:
    """The same book before a far fence, which looks alike at many depths."""
    fence = 60.0 + 40.0 * np.sin((tx - shift * FAR_PER_M) * 2.0 * np.pi * F_PX / 12.0) + 0.0 * ty
    across = tx - shift * NEAR_PER_M
    return np.where(across < EDGE_TX, fence, 255.0 - _texture(across, ty + FRAME_TAN))


Scene = Callable[[NDArray[np.float64], NDArray[np.float64], float], NDArray[np.float64]]


@cache
def _wide_tangents() -> NDArray[np.float64]:
    """Return the tangents of all wide pixels, (2, h, w)."""
    rows, columns = np.mgrid[0 : WIDE.height, 0 : WIDE.width].astype(np.float64)
    pixels = np.column_stack([columns.ravel(), rows.ravel()])
    return np.tan(WIDE.angles_rad(pixels)).T.reshape(2, WIDE.height, WIDE.width)


def _place(scene: Scene, *, rim_px: int = RIM_PX) -> BorderPlace:
    tx, ty = _wide_tangents()
    gray = scene(tx, ty, 0.0).astype(np.uint8)
    flat = tx < EDGE_TX - 4.0 / WIDE.fx_px
    patch = border_patch(gray, 255 * flat.astype(np.uint8), WIDE, PLACE, f_px=F_PX, rim_px=rim_px, noise=1.0)
    return BorderPlace(patch, inverse_z_per_m=GRID_PER_M, baseline_m=BASELINE_M, f_px=F_PX)


def _look(scene: Scene, *, at_per_m: float, half_px: int = 160) -> LookRows:
    """Return what both foveae show when they verge on the place at a depth."""
    eyes = []
    for side in (1.0, -1.0):
        shift = side * 0.5 * BASELINE_M
        u0_px = round(F_PX * (EDGE_TX + shift * at_per_m)) - half_px
        rows, columns = np.mgrid[-60:61, 0 : 2 * half_px + 1].astype(np.float64)
        image = scene((columns + u0_px) / F_PX, rows / F_PX, shift).astype(np.float32)
        eyes.append(ReducedEye(image=image, seen=np.ones_like(image), u0_px=u0_px, v0_px=-60.0))
    return LookRows.of(ReducedLook(left=eyes[0], right=eyes[1], f_px=F_PX))


def test_an_edge_of_the_region_is_told_from_one_of_something_nearer_by_what_lies_beyond() -> None:
    own, foreign = _place(_card_before_wall), _place(_wall_behind_book)
    own.add(_look(_card_before_wall, at_per_m=0.3))
    foreign.add(_look(_wall_behind_book, at_per_m=0.3))

    found, other = own.depth(), foreign.depth()

    assert found is not None and other is not None
    for one in (found, other):
        assert one.inverse_z_per_m == pytest.approx(NEAR_PER_M, abs=3.0 * one.sigma_per_m)
        assert one.by_both
    assert found.beyond is not None and found.beyond < 0.85
    assert other.beyond is not None and other.beyond > 0.96


def test_nothing_is_told_before_a_look_and_of_what_no_look_shows() -> None:
    place = _place(_wall_behind_book)
    assert place.depth() is None
    place.add(_look(_wall_behind_book, at_per_m=0.75, half_px=40))
    assert place.depth() is None


def test_the_outer_edge_of_a_frame_is_not_taken_for_the_inner_one() -> None:
    place = _place(_framed_board)
    place.add(_look(_framed_board, at_per_m=FAR_PER_M + FRAME_PER_M, half_px=60))
    partial = place.depth()
    place.add(_look(_framed_board, at_per_m=FAR_PER_M))
    found = place.depth()

    assert partial is None or not partial.by_both
    assert found is not None and found.by_both
    assert found.inverse_z_per_m == pytest.approx(FAR_PER_M, abs=3.0 * found.sigma_per_m)


def test_a_target_beside_something_nearer_is_told_by_its_own_side_alone() -> None:
    place = _place(_book_before_wall, rim_px=0)
    place.add(_look(_book_before_wall, at_per_m=FAR_PER_M))
    sure = place.sure_of_each()
    assert Role.LEFT in sure  # the book hides that side from neither eye, and is not compared
    for inverse_z, sigma in sure.values():
        assert inverse_z == pytest.approx(FAR_PER_M, abs=3.0 * sigma)
        assert sigma < 0.05 * NEAR_PER_M


@pytest.mark.parametrize(
    ("wall_per_m", "most_px", "told"), [(0.6, 7.0, True), (0.6, 4.0, False), (0.03, 7.0, False)]
)
def test_an_own_side_is_told_only_where_it_is_distinct(
    monkeypatch: pytest.MonkeyPatch, wall_per_m: float, *, most_px: float, told: bool
) -> None:
    """Its depths within the lead spread by 5.5 px: 1.5 % of 1/Z near, 30 % far."""
    monkeypatch.setattr(border_depth, "MOST_SPREAD_PX", most_px)
    scene = partial(_soft_wall_behind_book, wall_per_m=wall_per_m)
    place = _place(scene, rim_px=0)
    place.add(_look(scene, at_per_m=wall_per_m))
    assert bool(place.sure_of_each()) is told


def test_an_own_side_that_looks_alike_at_many_depths_tells_nothing_by_one_eye() -> None:
    place = _place(_book_before_fence, rim_px=0)
    place.add(_look(_book_before_fence, at_per_m=FAR_PER_M))
    assert place.sure_of_each() == {}


def test_an_own_side_without_texture_tells_nothing() -> None:
    place = _place(_wall_behind_book, rim_px=0)
    place.add(_look(_wall_behind_book, at_per_m=FAR_PER_M))
    assert not place.patch.textured
    assert place.sure_of_each() == {}


def test_an_own_side_that_hardly_counts_tells_nothing() -> None:
    place = _place(_book_before_wall, rim_px=0)
    place.patch.weights[:] = 0.0
    place.add(_look(_book_before_wall, at_per_m=FAR_PER_M))
    assert place.sure_of_each() == {}


@pytest.mark.parametrize(("off_per_m", "measured"), [(4e-3, True), (-4e-3, True), (2e-2, False)])
def test_an_edge_that_both_eyes_show_is_measured_by_left_against_right(
    off_per_m: float, *, measured: bool
) -> None:
    q = 0.25
    head = PlaneHead(z_m=1.0 / q, texture=noise_texture())
    looking = FixationHead(
        head, CALIBRATION, clock=head.clock, limits=VergeSettings(), on_step=None, cancelled=None
    )
    edges = FineEdges(CALIBRATION)
    edges.add(looking.look(aim_at(CALIBRATION, PLACE, q), VergePhase.SURROUNDINGS))
    coarse = BorderDepth(
        tangents=(EDGE_TX, 0.0),
        inverse_z_per_m=q + off_per_m,
        sigma_per_m=2e-3,
        score=0.95,
        by_both=True,
        beyond=None,
    )
    (found,) = edges.measured([coarse])
    assert (found != coarse) is measured  # a match far from the coarse depth is of something else
    if measured:
        assert found.inverse_z_per_m == pytest.approx(q, abs=0.05 * abs(off_per_m))
        posed_px = CALIBRATION.pose_sigma_px(1.0 / q)
        edge_px = math.sqrt(
            (found.sigma_per_m * CALIBRATION.fovea_f_px * CALIBRATION.baseline_m) ** 2 - posed_px**2
        )
        assert 0.7 * 2.1 < edge_px < 1.4 * 2.1  # as of the edges of a rendered card
