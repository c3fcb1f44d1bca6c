"""Stage 1 as a procedure, before a camera that shows drawn boards in virtual time."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.board_scenes import SMALL, Pose, board_picture

from foveacam_hardware.contract import (
    Cancelled,
    Frame,
    InvalidInput,
    LookOptions,
    Role,
    Sighting,
    StereoVolts,
    Timeout,
    VirtualClock,
)
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco, Checkerboard
from foveacam_pipeline.calibrate.wide.wide_run import WideSettings, calibrate_wide
from foveacam_pipeline.calibrate.wide.wide_samples import WideSamples

pytestmark = pytest.mark.slow

BOARD = Charuco()
POSES = [
    Pose(place_m=(0.0, 0.0, 1.0)),
    Pose(place_m=(0.0, 0.0, 1.05), turn_rad=(0.4, 0.0, 0.0)),
    Pose(place_m=(-0.08, 0.05, 1.2), turn_rad=(0.0, -0.4, 0.0)),
    Pose(place_m=(0.08, -0.05, 1.2), turn_rad=(-0.4, 0.0, 0.1)),
    Pose(place_m=(0.08, 0.05, 1.3), turn_rad=(0.0, 0.4, -0.1)),
    Pose(place_m=(-0.08, -0.05, 1.3), turn_rad=(0.3, 0.3, 0.0)),
]
HOLD_NS = 600_000_000


class Shown:
    """A wide camera before which each picture is held for a while, over and over; a look takes `look_ns`."""

    def __init__(
        self,
        clock: VirtualClock,
        pictures: list[NDArray[np.uint8]],
        *,
        hold_ns: int = HOLD_NS,
        look_ns: int = 0,
    ) -> None:
        self.clock, self.pictures = clock, pictures
        self.hold_ns, self.look_ns = hold_ns, look_ns

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        t_ns = self.clock.now_ns()
        self.clock.sleep_until_ns(t_ns + self.look_ns)
        image = self.pictures[(t_ns // self.hold_ns) % len(self.pictures)]
        return Frame(image=image, role=Role.WIDE, seq=0, t_ns=t_ns, exposure_ns=8_000_000)

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        raise AssertionError("stage 1 moves no mirror")

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        raise AssertionError("stage 1 touches no fovea")

    def set_low_pass(self, cutoff_hz: int) -> int:
        raise AssertionError("stage 1 touches no filter")


class Operator:
    """Watches; has had enough after so many views."""

    def __init__(self, *, enough: int = 1000) -> None:
        self.enough = enough
        self.sample_ids: list[str] = []
        self.notes: list[str] = []
        self.shown: list[NDArray[np.uint8]] = []

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        self.notes.append(f"{done}/{total} {note}")

    def cancelled(self) -> bool:
        return len(self.sample_ids) >= self.enough

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        assert name == "wide"
        self.shown.append(image)

    def sample(self, sample_id: str) -> None:
        self.sample_ids.append(sample_id)


@pytest.fixture(scope="module")
def pictures() -> list[NDArray[np.uint8]]:
    return [board_picture(BOARD, pose, lens=SMALL, seed=k) for k, pose in enumerate(POSES)]


def _run(
    pictures: list[NDArray[np.uint8]],
    watch: Operator,
    *,
    board: Board = BOARD,
    settings: WideSettings | None = None,
) -> WideSamples:
    clock = VirtualClock()
    return calibrate_wide(Shown(clock, pictures), board, clock=clock, watch=watch, settings=settings)


def test_every_pose_is_taken_once_then_it_ends_for_want_of_news(pictures: list[NDArray[np.uint8]]) -> None:
    watch = Operator()
    samples = _run(pictures, watch, settings=WideSettings(patience_s=4.0))
    assert len(samples) == len(POSES)
    assert watch.sample_ids == [sample.id for sample in samples]
    assert all(sample.frames == 3 for sample in samples)
    assert any("seen already" in note for note in watch.notes)
    assert {image.shape for image in watch.shown} == {(270, 360, 3)}


def test_it_ends_with_as_many_views_as_were_asked_for(pictures: list[NDArray[np.uint8]]) -> None:
    assert len(_run(pictures, Operator(), settings=WideSettings(views=2))) == 2


def test_a_cancelled_run_keeps_its_views_and_goes_on_from_them(
    pictures: list[NDArray[np.uint8]], tmp_path: Path
) -> None:
    with pytest.raises(Cancelled, match="what was measured is kept"):
        _run(pictures, Operator(enough=2), settings=WideSettings(folder=tmp_path))
    kept = [sample.id for sample in WideSamples.load(tmp_path)]
    assert len(kept) == 2
    watch = Operator()
    samples = _run(pictures, watch, settings=WideSettings(views=4, folder=tmp_path))
    assert [sample.id for sample in samples][:2] == kept
    assert len(watch.sample_ids) == 2


def test_a_folder_of_another_boards_views_is_refused_before_anything_is_taken(
    pictures: list[NDArray[np.uint8]], tmp_path: Path
) -> None:
    _run(pictures, Operator(), settings=WideSettings(views=1, folder=tmp_path))
    watch = Operator()
    with pytest.raises(InvalidInput, match="use one board, or begin anew"):
        _run(pictures, watch, board=Checkerboard(), settings=WideSettings(folder=tmp_path))
    assert not watch.shown


def test_no_board_in_view_ends_in_time_and_says_so() -> None:
    wall = [np.full((540, 720), 90, dtype=np.uint8)]
    with pytest.raises(Timeout, match=r"no ChArUco board of 9 x 6.*in 3 s; nothing like a board was found"):
        _run(wall, Operator(), settings=WideSettings(patience_s=3.0))


def test_the_wrong_board_in_view_is_named(pictures: list[NDArray[np.uint8]]) -> None:
    with pytest.raises(Timeout, match="placed as on a ChArUco board of 8 x 6"):
        _run(pictures[:1], Operator(), board=Charuco(columns=8), settings=WideSettings(patience_s=1.0))


def test_a_machine_that_takes_a_second_to_look_waits_longer_and_finds_the_same(
    pictures: list[NDArray[np.uint8]],
) -> None:
    clock = VirtualClock()
    slow = Shown(clock, pictures, hold_ns=1_600_000_000, look_ns=1_000_000_000)
    samples = calibrate_wide(
        slow, BOARD, clock=clock, watch=Operator(), settings=WideSettings(patience_s=4.0, views=len(POSES))
    )
    assert len(samples) == len(POSES)
    assert {sample.frames for sample in samples} == {1}


def test_too_little_shown_is_refused_with_what_was_taken(pictures: list[NDArray[np.uint8]]) -> None:
    with pytest.raises(Timeout, match="2 views were taken, 5 are the least"):
        _run(pictures[:2], Operator(), settings=WideSettings(patience_s=3.0))
