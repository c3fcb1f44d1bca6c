"""Connections that wait for their next request."""

import http.client
import time

from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.routing import Route
from tests.local_server import serving

CLIENTS_KEEP_S = 5.0
"""Time for which many clients keep an idle connection; uvicorn's default as well."""


def test_a_connection_is_kept_longer_than_clients_keep_it() -> None:
    application = Starlette(routes=[Route("/", lambda _: PlainTextResponse("here"))])
    with serving(application) as port:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10.0)
        connection.request("GET", "/")
        assert connection.getresponse().read() == b"here"
        used = connection.sock
        time.sleep(CLIENTS_KEEP_S + 0.5)
        connection.request("GET", "/")
        assert connection.getresponse().read() == b"here"
        assert connection.sock is used
        connection.close()
