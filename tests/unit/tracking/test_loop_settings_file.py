"""Settings of the vergence loop: their file, changes by REST, defaults by group."""

from pathlib import Path
from typing import get_args

import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.continuous_loop.settings import Gains, LoopSettings
from foveacam_pipeline.track.image_tracker import TrackerKind
from foveacam_server.resources.looking.loop.schema import LoopGains, LoopSettingsGroup, LoopSettingsPatch
from foveacam_server.resources.looking.loop.settings_file import (
    FILE,
    GROUPS,
    describe_settings,
    load_settings,
    patched,
    store_settings,
    with_defaults,
)

OTHER = LoopSettings(
    sensitivity=0.5,
    correct_for_ms=0.0,
    pan=Gains(kp=0.5, ki=0.1, kd=0.2),
    tracker=None,
    box_width_px=100,
    predict=False,
    most_hz=12.5,
)


@pytest.mark.parametrize("settings", [LoopSettings(), OTHER])
def test_stored_settings_are_loaded_again(tmp_path: Path, settings: LoopSettings) -> None:
    store_settings(tmp_path / "loop", settings)
    assert load_settings(tmp_path / "loop") == settings


def test_the_defaults_are_loaded_where_nothing_is_stored(tmp_path: Path) -> None:
    assert load_settings(tmp_path / "nowhere") == LoopSettings()


@pytest.mark.parametrize("content", ["{", '{"sensitivity": 7}', '{"unknown": 1}', "[]"])
def test_a_file_that_cannot_be_read_gives_the_defaults_and_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, content: str
) -> None:
    (tmp_path / FILE).write_text(content)
    assert load_settings(tmp_path) == LoopSettings()
    assert "default settings" in caplog.text


def test_what_a_change_leaves_out_stays() -> None:
    gains = LoopGains(kp=0.3, ki=0.0, kd=0.1)
    changed = patched(OTHER, LoopSettingsPatch(depth=gains, tracker="filter"))
    assert changed.depth == Gains(kp=0.3, ki=0.0, kd=0.1)
    assert changed.tracker is TrackerKind.FILTER
    assert (changed.pan, changed.most_hz, changed.predict) == (OTHER.pan, 12.5, False)


def test_null_means_always_and_unlimited_and_changes_no_other_setting() -> None:
    patch = LoopSettingsPatch(correct_for_ms=None, most_hz=None, sensitivity=None, pan=None)
    changed = patched(OTHER, patch)
    assert (changed.correct_for_ms, changed.most_hz) == (None, None)
    assert (changed.sensitivity, changed.pan) == (0.5, OTHER.pan)


def test_off_is_no_tracker() -> None:
    assert patched(LoopSettings(), LoopSettingsPatch(tracker="off")).tracker is None
    assert describe_settings(OTHER).tracker == "off"


def test_each_setting_belongs_to_one_group() -> None:
    names = [name for group in GROUPS.values() for name in group]
    assert sorted(names) == sorted(LoopSettingsPatch.model_fields)
    assert set(GROUPS) == set(get_args(LoopSettingsGroup))


def test_a_group_goes_back_to_its_defaults_alone() -> None:
    reset = with_defaults(OTHER, "timing")
    assert (reset.sensitivity, reset.correct_for_ms, reset.most_hz) == (0.1, None, None)
    assert (reset.pan, reset.tracker) == (OTHER.pan, None)
    assert with_defaults(OTHER, None) == LoopSettings()


def test_the_pipeline_refuses_what_is_out_of_its_bounds() -> None:
    with pytest.raises(InvalidInput, match=r"sensitivity: asked 2, choose 0\.01 to 1"):
        LoopSettings(sensitivity=2.0)
    with pytest.raises(InvalidInput, match=r"pan\.ki: asked 3, choose 0 to 2"):
        LoopSettings(pan=Gains(kp=0.1, ki=3.0, kd=0.0))
