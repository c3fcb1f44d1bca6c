"""When a view is taken by itself."""

import numpy as np
from tests.support.scenes.board_scenes import Pose, board_view

from foveacam_pipeline.calibrate.wide.auto_capture import AutoCapture, AutoCaptureVerdict
from foveacam_pipeline.calibrate.wide.board_detector import BoardView
from foveacam_pipeline.calibrate.wide.boards import Charuco

BOARD = Charuco()


def _view(x_m: float = 0.0, *, seed: int = 0, noise_px: float = 0.02) -> BoardView:
    return board_view(BOARD, Pose(place_m=(x_m, 0.0, 1.2)), noise_px=noise_px, seed=seed)


def _offer(
    capture: AutoCapture, view: BoardView | None, *, is_new: bool = True, t_s: float = 0.0
) -> AutoCaptureVerdict:
    return capture.add_image(view, t_ns=round(t_s * 1e9), exact=lambda: view, is_new=lambda _: is_new)


def test_a_board_held_still_is_taken_as_the_mean_of_three_images() -> None:
    capture, views = AutoCapture(frames=3), [_view(seed=seed) for seed in range(4)]
    states = [_offer(capture, view) for view in views]
    assert [verdict.state for verdict in states] == ["moving", "holding", "holding", "taken"]
    assert states[-1].view is not None
    np.testing.assert_allclose(
        states[-1].view.corners_px, np.mean([v.corners_px for v in views[1:]], axis=0), atol=1e-12
    )


def test_of_images_that_come_slowly_as_many_do_as_the_board_was_still_for() -> None:
    capture, views = AutoCapture(frames=3, held_s=0.5), [_view(seed=seed) for seed in range(3)]
    states = [_offer(capture, view, t_s=0.3 * k) for k, view in enumerate(views)]
    assert [verdict.state for verdict in states] == ["moving", "holding", "taken"]
    assert states[-1].frames == 2


def test_a_moving_board_is_never_taken() -> None:
    capture = AutoCapture(frames=1)
    assert {_offer(capture, _view(0.001 * k)).state for k in range(10)} == {"moving"}


def test_a_board_that_creeps_while_it_is_held_is_not_taken() -> None:
    # 0.1 mm an image is 0.26 px: still from one image to the next, but not over three
    capture = AutoCapture(frames=4, still_px=0.4)
    states = [_offer(capture, _view(1e-4 * k, noise_px=0.0)).state for k in range(12)]
    assert "holding" in states
    assert "taken" not in states


def test_what_adds_nothing_is_not_taken() -> None:
    capture = AutoCapture(frames=1)
    assert [_offer(capture, _view(), is_new=False).state for _ in range(3)][-1] == "nothing new"


def test_a_lost_board_begins_anew() -> None:
    capture = AutoCapture(frames=2)
    for view in (_view(), _view(seed=1)):
        _offer(capture, view)
    assert _offer(capture, None).state == "no board"
    assert _offer(capture, _view(seed=2)).state == "moving"
    assert _offer(capture, _view(seed=3)).state == "holding"


def test_corners_that_one_image_lacks_are_left_out_of_the_mean() -> None:
    capture = AutoCapture(frames=2)
    whole = _view()
    part = BoardView(
        board=BOARD,
        corners_px=whole.corners_px[3:],
        ids=whole.ids[3:],
        width=whole.width,
        height=whole.height,
    )
    _offer(capture, whole)
    _offer(capture, whole)
    taken = _offer(capture, part)
    assert taken.view is not None
    np.testing.assert_array_equal(taken.view.ids, np.arange(3, 54))
