"""The file that names the rigs of a lab."""

from pathlib import Path

import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_server.resources.operating.rigs.rig_list import read_rig_list

LIST = """
[[rig]]
name = "Bench by the window"
url = "http://rig-1.lab.example:8000"

[[rig]]
name = "Roof"
url = "https://lab.example/roof/"
token_file = "roof.token"
"""


def test_rigs_are_read_with_their_tokens_beside_the_list(tmp_path: Path) -> None:
    path = tmp_path / "rigs.toml"
    path.write_text(LIST)
    window, roof = read_rig_list(path)
    assert (window.name, str(window.url), window.token_file) == (
        "Bench by the window",
        "http://rig-1.lab.example:8000/",
        None,
    )
    assert roof.token_file == tmp_path / "roof.token"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (None, "No such file"),
        ("[[rig]\n", "rigs.toml cannot be used"),
        ("", "rig"),
        ('[[rig]]\nname = "a"\n', "url"),
        ('[[rig]]\nname = "a"\nurl = "file:///etc/passwd"\n', "url"),
        ('[[rig]]\nname = "a"\nurl = "http://x"\ntoken = "secret"\n', "token"),
        (LIST + LIST, "names Bench by the window twice"),
    ],
)
def test_a_list_that_cannot_be_used_is_refused_with_what_to_write(
    tmp_path: Path, content: str | None, reason: str
) -> None:
    path = tmp_path / "rigs.toml"
    if content is not None:
        path.write_text(content)
    with pytest.raises(InvalidInput, match=reason) as refused:
        read_rig_list(path)
    assert "[[rig]]" in str(refused.value)
