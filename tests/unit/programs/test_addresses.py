"""Addresses of servers, at the root of a site and below a path."""

import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.http.addresses import join_address, server_address, websocket_address


@pytest.mark.parametrize(
    "base", ["http://h:8000/lab/foveacam", "HTTP://h:8000/lab/foveacam/", " http://h:8000/lab/foveacam//"]
)
@pytest.mark.parametrize("path", ["/api/v1/jobs?limit=1", "api/v1/jobs?limit=1"])
def test_a_path_comes_below_that_of_the_server(base: str, path: str) -> None:
    assert join_address(server_address(base), path) == "http://h:8000/lab/foveacam/api/v1/jobs?limit=1"


def test_a_websocket_is_encrypted_where_the_server_is() -> None:
    assert websocket_address("http://h/lab/", "/ws") == "ws://h/lab/ws"
    assert websocket_address("https://h", "/ws") == "wss://h/ws"
    assert websocket_address("http://[::1]:80", "/ws") == "ws://[::1]:80/ws"


@pytest.mark.parametrize(
    "given",
    ["", "here", "127.0.0.1:8000", "ftp://h", "http://", "http://h:port", "http://[::1", "http://h/?a=1"],
)
def test_what_is_no_address_is_refused_with_an_example(given: str) -> None:
    with pytest.raises(InvalidInput, match="give the address that a browser opens"):
        server_address(given)
