"""Every port that the server opens, asked by whoever should not be let in."""

from collections.abc import Callable

from foveacam_bench.doors.foreign import foreign_figures

from .conftest import Program


def test_the_server_opens_one_port_and_no_foreigner_is_accepted(program: Callable[..., Program]) -> None:
    started = program()
    found = foreign_figures(started.url, pid=started.process.pid)
    assert found["ports"] == 1  # also with the 3D pane
    assert found["foreign_accepted_which"] == []
