"""`foveacam capture --server`: the same jobs as by REST, begun, watched, cancelled and gone on with."""

import json
import os
import signal
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from foveacam_client import Rig
from foveacam_pipeline.capture.dataset import check_dataset
from foveacam_server import cli
from tests.support.servers.running_server import EVENT_PATIENCE_S, Running

pytestmark = pytest.mark.usefixtures("grey")

FOUR = (
    "--columns",
    "2",
    "--rows",
    "2",
    "--half-width-deg",
    "1",
    "--half-height-deg",
    "1",
    "--distance-m",
    "4",
)
Run = Callable[..., tuple[int, str, str]]
Soon = Callable[[Callable[[], None]], None]


@pytest.fixture
def run(api_server: Running, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run `foveacam capture … --server`; return its status and what it printed."""

    def call(*words: str) -> tuple[int, str, str]:
        address = f"http://127.0.0.1:{api_server.port}"
        monkeypatch.setattr("sys.argv", ["foveacam", "capture", *words, "--server", address])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        assert isinstance(ended.value.code, int)
        told = capsys.readouterr()
        return ended.value.code, told.out, told.err

    return call


def wait_until(found: Callable[[], bool]) -> None:
    waiting = threading.Event()
    for _ in range(round(EVENT_PATIENCE_S / 0.02)):
        if found():
            return
        waiting.wait(0.02)
    raise AssertionError(found)


def state_of(server: Running, name: str) -> str | None:
    """Return the state of the job that makes a capture."""
    kept = server.get("/captures", text=name).json()
    if not kept or kept[0]["job_id"] is None:
        return None
    return str(server.get(f"/jobs/{kept[0]['job_id']}").json()["state"])


@pytest.fixture
def soon() -> Iterator[Soon]:
    """Do something beside the command that runs in the test's own thread."""
    threads = []

    def begin(work: Callable[[], None]) -> None:
        threads.append(threading.Thread(target=work))
        threads[-1].start()

    yield begin
    for thread in threads:
        thread.join()


@pytest.fixture
def press_ctrl_c(api_server: Running, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], None]]:
    """Press it once a capture runs and the command waits for it."""
    waits, wait = threading.Event(), Rig.wait

    def noticed(*given: Any, **options: Any) -> Any:  # noqa: ANN401 - as of `Rig.wait`
        waits.set()
        return wait(*given, **options)

    def press(name: str) -> None:
        wait_until(lambda: waits.is_set() and state_of(api_server, name) == "running")
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(Rig, "wait", noticed)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    yield press
    signal.signal(signal.SIGINT, before)


def test_a_capture_is_taken_by_the_server_and_printed(api_server: Running, run: Run) -> None:
    status, printed, _ = run("--name", "from afar", "--label", "by command", *FOUR)
    assert status == 0
    assert printed.strip().endswith("complete, 4 of 4 points, 19 MB")
    kept = api_server.get("/captures", text="from afar").json()[0]
    assert (kept["label"], kept["points"]["taken"]) == ("by command", 4)
    assert check_dataset(kept["folder"]) == []
    assert run("--name", "from afar", *FOUR)[0] == 2
    status, printed, _ = run("--name", "from afar", "--json", "--estimate", *FOUR)
    assert (status, json.loads(printed)["points"]) == (0, 4)
    for deed, told in (
        ("--resume", "it is complete"),
        ("--watch", "nothing to watch"),
        ("--cancel", "nothing"),
    ):
        status, _, error = run("--name", "from afar", deed)
        assert (status, told in error) == (2, True), error
    assert "it has no capture 'another'" in run("--name", "another", "--resume")[2]


def test_ctrl_c_cancels_what_was_begun_here_and_it_goes_on_where_it_ended(
    api_server: Running, run: Run, gate: threading.Event, soon: Soon, press_ctrl_c: Callable[[str], None]
) -> None:
    def interrupt() -> None:
        press_ctrl_c("ended early")
        wait_until(lambda: state_of(api_server, "ended early") != "running")
        gate.set()

    soon(interrupt)
    status, printed, _ = run("--name", "ended early", *FOUR)
    assert status == 130
    assert "partial, " in printed
    taken = api_server.get("/captures", text="ended early").json()[0]["points"]["taken"]
    assert taken < 4
    status, printed, _ = run("--name", "ended early", "--resume", "--json")
    assert status == 0
    found = json.loads(printed)
    assert (found["state"], found["points"]["taken"]) == ("complete", 4)


def test_what_others_began_is_watched_without_harm_and_cancelled_by_wish(
    api_server: Running, run: Run, gate: threading.Event, soon: Soon, press_ctrl_c: Callable[[str], None]
) -> None:
    plan = {
        "points": {"kind": "grid", "columns": 2, "rows": 2, "half_width_deg": 1, "half_height_deg": 1},
        "verging": {"mode": "given", "distance_m": 4.0},
    }
    job = api_server.post("/captures", {"name": "by rest", "plan": plan}).json()
    soon(lambda: press_ctrl_c("by rest"))
    status, printed, told = run("--name", "by rest", "--watch")
    assert (status, printed) == (130, "")
    assert "it continues; to cancel it: foveacam capture --cancel --name 'by rest' --server" in told
    assert api_server.get(f"/jobs/{job['id']}").json()["state"] == "running"

    def let_it_end() -> None:
        wait_until(lambda: state_of(api_server, "by rest") != "running")
        gate.set()

    soon(let_it_end)
    status, printed, _ = run("--name", "by rest", "--cancel")
    assert (status, "partial, " in printed) == (0, True)
    assert api_server.get(f"/jobs/{job['id']}").json()["state"] == "cancelled"


def test_a_capture_that_ended_before_its_first_point_says_so(
    api_server: Running, run: Run, gate: threading.Event, soon: Soon, press_ctrl_c: Callable[[str], None]
) -> None:
    survey = FOUR[: FOUR.index("--distance-m")]  # the scene's distance is measured first

    def interrupt() -> None:
        wait_until(lambda: state_of(api_server, "too soon") == "running")
        press_ctrl_c("too soon")
        wait_until(lambda: state_of(api_server, "too soon") != "running")
        gate.set()

    soon(interrupt)
    status, printed, told = run("--name", "too soon", *survey)
    assert (status, printed) == (130, "")
    assert "capture too soon ended before its first point: nothing was taken" in told
