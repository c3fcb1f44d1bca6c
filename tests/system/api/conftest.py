"""One server on the simulated rig for all files of this folder."""

from collections.abc import Iterator

import pytest

from tests.support.scenes.marker_room import make_grey
from tests.support.servers.running_server import PATIENCE_S, Running, running

LIVE_HZ = 1.0, 0.5
"""Of the live views, at which few look: they cost time while something else is waited for."""


@pytest.fixture(scope="package")
def shared_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("data"), live_hz=LIVE_HZ) as found:
        yield found


@pytest.fixture(scope="module")
def api_server(shared_server: Running) -> Running:
    """Return the folder's server in the state in which it starts."""
    shared_server.reset()
    return shared_server


@pytest.fixture(scope="module")
def grey(api_server: Running) -> Iterator[None]:
    """Let all cameras deliver grey values in a file that looks at no colour: colours cost time."""
    rig = api_server.rig
    before = [(camera, camera.settings) for camera in rig.cameras]
    api_server.services.hardware.submit(lambda _: make_grey(rig)).result(PATIENCE_S)
    yield
    api_server.services.hardware.submit(
        lambda _: [camera.configure(settings) for camera, settings in before]
    ).result(PATIENCE_S)
