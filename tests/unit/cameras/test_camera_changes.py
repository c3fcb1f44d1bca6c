"""What an operator wants of a camera: a number by itself is by hand, and once is not asked again."""

from dataclasses import replace

import pytest
from tests.support.devices.fake_camera import FakeCamera, supervised

from foveacam_hardware.contract import AutoMode, CameraSettings, OutOfRange, Role, TriggerSource, VirtualClock
from foveacam_server.resources.devices.cameras.changes import CameraChange, refuse_own_exposure

AUTOMATIC = CameraSettings(exposure_ns=9_000_000, exposure_auto=AutoMode.CONTINUOUS, frame_rate_auto=True)
PULSED = replace(AUTOMATIC, triggered=True)


def test_an_exposure_by_itself_switches_the_automatic_off() -> None:
    settings = CameraChange(exposure_ns=5_000_000).applied_to(AUTOMATIC)

    assert (settings.exposure_ns, settings.exposure_auto) == (5_000_000, AutoMode.OFF)
    assert settings.frame_rate_auto


def test_a_rate_by_itself_switches_the_automatic_off() -> None:
    settings = CameraChange(frame_rate_hz=20.0).applied_to(AUTOMATIC)

    assert (settings.frame_rate_hz, settings.frame_rate_auto) == (20.0, False)
    assert settings.exposure_auto is AutoMode.CONTINUOUS


def test_an_exposure_with_a_mode_is_where_it_begins() -> None:
    wish = CameraChange(exposure_ns=5_000_000, exposure_auto=AutoMode.ONCE)

    assert wish.applied_to(AUTOMATIC).exposure_auto is AutoMode.ONCE
    assert wish.lasting["exposure_auto"] is AutoMode.OFF


def test_what_is_not_named_stays() -> None:
    assert CameraChange(gain_db=3.0).applied_to(AUTOMATIC) == replace(AUTOMATIC, gain_db=3.0)
    assert not CameraChange().changes


@pytest.mark.parametrize("mode", [AutoMode.ONCE, AutoMode.CONTINUOUS])
def test_a_fovea_on_a_pulse_may_not_expose_by_itself(mode: AutoMode) -> None:
    left = supervised(FakeCamera(VirtualClock(0)))
    with pytest.raises(OutOfRange, match=r"camera left: .* one pulse exposes both foveae alike") as refusal:
        refuse_own_exposure(left, replace(PULSED, exposure_auto=mode))

    assert refusal.value.remedy == 'ask for "once" with linked, which finds one exposure for both'


@pytest.mark.parametrize(
    ("role", "settings"),
    [
        (Role.WIDE, PULSED),
        (Role.LEFT, AUTOMATIC),
        (Role.LEFT, replace(PULSED, trigger_source=TriggerSource.SOFTWARE)),
        (Role.LEFT, replace(PULSED, exposure_auto=AutoMode.OFF)),
    ],
)
def test_whoever_shares_no_pulse_may(role: Role, settings: CameraSettings) -> None:
    refuse_own_exposure(supervised(FakeCamera(VirtualClock(0)), role=role), settings)
