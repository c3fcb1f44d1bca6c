"""Connections that wait for their next request."""

import http.client
import logging
import time

import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from starlette.routing import Route
from tests.support.servers.local_server import serving

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


def test_an_error_whose_answer_is_complete_keeps_the_connection(caplog: pytest.LogCaptureFixture) -> None:
    """Else a request that a client sends at once meets a connection that is being closed."""

    def broken(_: Request) -> PlainTextResponse:
        raise ZeroDivisionError("nobody foresaw it")

    application = Starlette(routes=[Route("/", broken)])
    with caplog.at_level(logging.ERROR), serving(application) as port:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10.0)
        used = []
        for _ in range(2):
            connection.request("GET", "/")
            answer = connection.getresponse()
            assert (answer.status, answer.read()) == (500, b"Internal Server Error")
            used.append(connection.sock)
            time.sleep(0.1)  # the answer comes before the application ends
        connection.close()
    assert used[0] is used[1]
    assert caplog.text.count("ZeroDivisionError: nobody foresaw it") == 2
