"""Names of datasets: one rule for every file system, nothing that hides from the eye."""

import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset import dataset_name


@pytest.mark.parametrize(
    "name", ["bench", "Bench 9x9, 5 m (a)", "été_2026-01", "Übung", "卓上", "v1.2", "comx"]
)
def test_plain_names_of_any_language_are_kept(name: str) -> None:
    assert dataset_name(name) == name


def test_accents_are_composed_so_that_one_name_is_one_folder() -> None:
    assert dataset_name("e\u0301te\u0301") == "été"


@pytest.mark.parametrize(
    "name",
    [
        "", " ", ".", "..", "../up", "a/b", "/etc", "a\\b", "C:", "a\0b", "x" * 300, "日" * 90, "a\nb",
        " lead", "trail ", "dot.", ".hidden", "-rf", "nul", "CON", "com1.txt", "LPT¹", "a\u202eb", "a\u200bb",
        "a\ufeff", "a\u00a0b", "a\u2028b", "a\uff0fb", "a\u2024.\u2024\uff0f", "\ud800", "a\ue000", "what?",
        "a|b", "a\u3164b", "a\ufe0fb", "a\u034fb", "\uffa0", "a\u2800", "a\U000e0100",
    ],
)  # fmt: skip
def test_names_that_leave_the_folder_or_deceive_are_refused_in_plain_ascii(name: str) -> None:
    with pytest.raises(InvalidInput, match=r"^name ") as refused:
        dataset_name(name)
    assert len(str(refused.value)) < 400
    str(refused.value).encode("utf-8")
