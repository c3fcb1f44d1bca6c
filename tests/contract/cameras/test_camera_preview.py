"""One picture of a camera that no rig has: on the vendor's emulator and on libaravis' fake camera."""

import numpy as np
import pytest
from tests.support.devices.gige_cameras import aravis_camera, fake_program

from foveacam_hardware.contract import InvalidInput, MonotonicClock, NotConnected
from foveacam_hardware.device_trials import named_camera, take_picture

CLOCK = MonotonicClock()


def test_basler_camera_is_opened_for_a_picture_and_let_go() -> None:
    for _ in range(2):
        image, bits = take_picture(named_camera("pylon", "0815-0002"), clock=CLOCK)
        assert image.dtype == np.uint8
        assert bits == 8
        assert image.max() > image.min()


def test_gige_camera_gives_a_picture_and_says_when_another_program_has_it() -> None:
    given = named_camera("aravis", "GV-8")
    with fake_program("GV-8"):
        image, _ = take_picture(given, clock=CLOCK)
        assert image.max() > image.min()
        held = aravis_camera("GV-8")
        held.connect()
        try:
            with pytest.raises(NotConnected, match="another program"):
                take_picture(given, clock=CLOCK)
        finally:
            held.close()
        take_picture(given, clock=CLOCK)


def test_camera_that_is_not_there_says_which_are() -> None:
    with pytest.raises(NotConnected, match="found: 0815-0000, 0815-0001, 0815-0002"):
        take_picture(named_camera("pylon", "0815-0009"), clock=CLOCK)


def test_serial_number_that_no_file_may_have_is_refused() -> None:
    with pytest.raises(InvalidInput, match="has spaces in it"):
        named_camera("pylon", "0815 0001")
