"""The binning of the cameras: the rig's own, a session's, a recording's; switched all or none, and back."""

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.support.devices.fake_rig import FakeCamera
from tests.support.devices.hardware_setup import PATIENCE_S, POLL_S, HardwareSetup, hardware_setup, never

from foveacam_hardware.contract import Busy, CameraSettings, InvalidInput, MonotonicClock, Role
from foveacam_server.foundation.settings import Settings
from foveacam_server.resources.devices.rig_state.binning_routes import binning_document
from foveacam_server.rig.hardware_thread.binning import RigBinning


class BinningCamera(FakeCamera):
    """Takes the binning that it is told, unless `refuses`."""

    refuses = False

    def configure(self, settings: CameraSettings) -> CameraSettings:
        if self.refuses and settings.binning == 2:
            raise InvalidInput(f"camera {self.role}: asked for binning 2, and it has 1; use 1")
        self.settings = settings
        return settings


@pytest.fixture
def setup(tmp_path: Path) -> Iterator[HardwareSetup]:
    with hardware_setup(tmp_path) as found:
        rig = found.rig
        rig.wide, rig.left, rig.right = (BinningCamera(role, MonotonicClock()) for role in Role)
        rig.working_binning = 2
        yield found


def binnings(setup: HardwareSetup) -> set[int]:
    """Return the binnings in force after the thread has done what came before."""
    rig = setup.rig
    answer = setup.hardware.submit(
        lambda _rig: {camera.settings.binning for camera in (rig.wide, rig.left, rig.right)}
    )
    return set(answer.result(PATIENCE_S))


def test_cameras_work_at_the_rigs_own_binning(setup: HardwareSetup) -> None:
    setup.start()
    assert binnings(setup) == {2}


def test_a_rig_is_open_only_once_its_cameras_have_the_working_binning(setup: HardwareSetup) -> None:
    at_opening: list[set[int]] = []

    class Opened(threading.Event):
        def set(self) -> None:
            at_opening.append({camera.settings.binning for camera in setup.hardware.status.cameras})
            super().set()

    setup.hardware._opened = Opened()
    setup.start()
    assert at_opening == [{2}]


def test_a_session_chooses_and_its_end_switches_back(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with hardware.session("a still", cancelled=never, binning=1):
        assert binnings(setup) == {1}
    setup.hardware.submit(lambda rig: None).result(PATIENCE_S)
    assert binnings(setup) == {2}
    with pytest.raises(Busy, match="camera left"), hardware.session("a still", cancelled=never, binning=1):
        raise Busy("camera left is busy")
    setup.hardware.submit(lambda rig: None).result(PATIENCE_S)
    assert binnings(setup) == {2}


def test_a_second_session_of_another_binning_waits_for_its_turn(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with (
        hardware.session("a capture", cancelled=never, binning=1),
        pytest.raises(Busy, match="a capture"),
        hardware.session("a fixation", cancelled=never),
    ):
        raise AssertionError
    with hardware.session("a fixation", cancelled=never):
        assert binnings(setup) == {2}


def test_a_recording_keeps_its_binning_through_sessions(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with hardware.recorded_at(1):
        assert binnings(setup) == {1}
        with hardware.session("a fixation", cancelled=never):
            assert binnings(setup) == {1}
    setup.hardware.submit(lambda rig: None).result(PATIENCE_S)
    assert binnings(setup) == {2}


def test_a_camera_that_refuses_leaves_all_as_they_were(setup: HardwareSetup) -> None:
    right = setup.rig.right
    assert isinstance(right, BinningCamera)
    right.refuses = True
    hardware = setup.start()
    assert binnings(setup) == {1}
    with hardware.session("a fixation", cancelled=never):
        assert binnings(setup) == {1}  # it works all the same
    with (
        pytest.raises(InvalidInput, match="asked for binning 2"),
        hardware.session("a job", cancelled=never, binning=2),
    ):
        raise AssertionError
    assert hardware.use.holder is None
    assert binnings(setup) == {1}


def test_a_recordings_binning_comes_before_a_sessions(setup: HardwareSetup) -> None:
    chosen = RigBinning()
    with chosen.session(2), chosen.recorded(1):
        assert chosen.wanted(setup.rig) == 1
    with chosen.session(1):
        assert chosen.wanted(setup.rig) == 1
    assert chosen.wanted(setup.rig) == 2


def test_the_working_binning_is_the_rigs_own_unless_the_settings_say_otherwise() -> None:
    assert (Settings().binning, Settings(binning="1").binning) == ("rig", "1")
    with pytest.raises(ValueError, match="'1', '2' or 'rig'"):
        Settings(binning="4")  # type: ignore[arg-type]  # what the command line may say


def test_the_working_binning_is_switched_at_once_and_its_time_is_measured(setup: HardwareSetup) -> None:
    hardware = setup.start()
    assert binnings(setup) == {2}
    hardware.choose_binning(1)
    assert binnings(setup) == {1}
    assert hardware.status.working_binning == 1
    assert hardware.binning.switch_s is not None and hardware.binning.switch_s > 0.0


def test_a_session_keeps_the_working_binning_of_its_beginning(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with hardware.session("a fixation", cancelled=never):
        assert binnings(setup) == {2}
        hardware.choose_binning(1)
        assert binnings(setup) == {2}
        document = binning_document(hardware)
        assert document is not None
        assert (document.working_binning, document.in_force, document.held_by) == (1, 2, "a fixation")
    hardware.submit(lambda rig: None).result(PATIENCE_S)
    assert binnings(setup) == {1}


def test_who_follows_gives_the_cameras_away_for_the_switch(setup: HardwareSetup) -> None:
    hardware = setup.start()
    began, switched = threading.Event(), threading.Event()

    def follow() -> None:
        with hardware.session("following", cancelled=never, gives_way=True):
            began.set()
            while not hardware.use.wanted:
                switched.wait(POLL_S)

    follower = threading.Thread(target=follow)
    follower.start()
    assert began.wait(PATIENCE_S)
    hardware.choose_binning(1)
    assert binnings(setup) == {1}
    follower.join(PATIENCE_S)
    assert hardware.use.holder is None


def test_a_recording_holds_the_switch_back_until_it_ends(setup: HardwareSetup) -> None:
    setup.rig.working_binning = 1
    hardware = setup.start()
    with hardware.recorded_at(1):
        hardware.choose_binning(2)
        document = binning_document(hardware)
        assert document is not None
        assert (document.working_binning, document.in_force, document.held_by) == (2, 1, "a recording")
    hardware.submit(lambda rig: None).result(PATIENCE_S)
    assert binnings(setup) == {2}


def test_a_session_that_asks_another_binning_than_a_recording_is_refused(setup: HardwareSetup) -> None:
    hardware = setup.start()
    with (
        hardware.recorded_at(1),
        pytest.raises(Busy, match="a recording keeps all cameras at binning 1; end the recording"),
        hardware.session("a job", cancelled=never, binning=2),
    ):
        raise AssertionError
    assert hardware.use.holder is None


def test_a_refused_working_binning_leaves_the_one_before(setup: HardwareSetup) -> None:
    setup.rig.working_binning = 1
    right = setup.rig.right
    assert isinstance(right, BinningCamera)
    right.refuses = True
    hardware = setup.start()
    with pytest.raises(InvalidInput, match="asked for binning 2, and it has 1; use 1"):
        hardware.choose_binning(2)
    assert binnings(setup) == {1}
    document = binning_document(hardware)
    assert document is not None
    assert (document.working_binning, document.problem) == (1, None)


def test_a_refusal_that_comes_later_is_told_until_another_binning_is_chosen(setup: HardwareSetup) -> None:
    right = setup.rig.right
    assert isinstance(right, BinningCamera)
    right.refuses = True
    hardware = setup.start()
    assert binnings(setup) == {1}
    document = binning_document(hardware)
    assert document is not None
    assert (document.working_binning, document.in_force, document.held_by) == (2, 1, None)
    assert document.problem == "camera right: asked for binning 2, and it has 1; use 1"
    hardware.choose_binning(1)
    document = binning_document(hardware)
    assert document is not None
    assert document.problem is None
