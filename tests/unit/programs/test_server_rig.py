"""What the server of a command with `--server` answers, as the command's own error."""

import pytest
from starlette.responses import HTMLResponse, JSONResponse, Response
from tests.support.servers.local_server import serving

from foveacam_hardware.contract import FoveaError, InvalidInput, NotConnected
from foveacam_server.commands.server_rig import server_rig


def problem(status: int) -> Response:
    document = {
        "type": "/problems/of-this-test",
        "title": "No",
        "status": status,
        "detail": "it captures",
    }
    return JSONResponse(document, status, media_type="application/problem+json")


@pytest.mark.parametrize(
    ("answer", "error", "message"),
    [
        (problem(409), FoveaError, "^it captures$"),
        (problem(422), InvalidInput, "^it captures$"),
        (
            HTMLResponse("<p>no such page", 404),
            InvalidInput,
            "no server of ours .* .it answered 404",
        ),
        (HTMLResponse("<p>welcome"), InvalidInput, "no server of ours .* .its answer is not as"),
        (JSONResponse({"captures": []}), InvalidInput, "is it of another version?"),
    ],
)
def test_an_answer_that_is_none_is_an_error_in_its_own_words(
    answer: Response, error: type[FoveaError], message: str
) -> None:
    with (
        serving(answer) as port,
        pytest.raises(error, match=message) as raised,
        server_rig(f"http://127.0.0.1:{port}", token=None) as rig,
    ):
        rig.datasets()
    assert type(raised.value) is error


@pytest.mark.parametrize(
    ("address", "error", "message"),
    [
        ("here", InvalidInput, "give the address that a browser opens it by"),
        (
            "http://127.0.0.1:1",
            NotConnected,
            "it was not reached .*refused.*; start it",
        ),
    ],
)
def test_a_server_that_is_not_there_is_an_error(address: str, error: type[FoveaError], message: str) -> None:
    with pytest.raises(error, match=message), server_rig(address, token=None) as rig:
        rig.datasets()
