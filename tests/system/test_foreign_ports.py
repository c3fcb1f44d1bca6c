"""Every port that the server opens, asked by whoever should not be let in."""

from collections.abc import Callable
from pathlib import Path

from foveacam_bench.doors.foreign import foreign_figures
from tests.support.servers.running_server import Program, missing_rig


def test_the_server_opens_one_port_and_no_foreigner_is_accepted(
    program: Callable[..., Program], tmp_path: Path
) -> None:
    started = program("--rig", missing_rig(tmp_path))
    found = foreign_figures(started.url, pid=started.process.pid)
    assert found["ports"] == 1  # also with the 3D pane
    assert found["foreign_accepted_which"] == []
