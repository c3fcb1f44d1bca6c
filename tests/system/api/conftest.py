"""One server on the simulated rig for all files of this folder."""

from collections.abc import Iterator

import pytest

from tests.system.conftest import Running, running


@pytest.fixture(scope="package")
def shared_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("data")) as found:
        yield found


@pytest.fixture(scope="module")
def server(shared_server: Running) -> Running:
    """Return the folder's server in the state in which it starts."""
    shared_server.reset()
    return shared_server
