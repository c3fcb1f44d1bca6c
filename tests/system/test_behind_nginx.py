"""Every command with `--server` on a server below a path of a site, behind a real nginx."""

import json
import shlex
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import typer
from typer.core import TyperGroup
from typer.testing import CliRunner

from foveacam_server.cli import app
from tests.support.servers.nginx_proxy import Nginx, nginx_before
from tests.support.servers.running_server import API, Running, gated, running

pytestmark = pytest.mark.timeout(300)

ROOT = "/lab/foveacam"
GRID = "--columns 2 --rows 1 --half-width-deg 1 --half-height-deg 1 --distance-m 2"


@pytest.fixture(scope="module")
def below(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("data"), root_path=ROOT) as found:
        yield found


@pytest.fixture(scope="module")
def nginx(below: Running, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Nginx]:
    with nginx_before(below.port, tmp_path_factory.mktemp("nginx"), path=ROOT) as found:
        yield found


def run(command: str, address: str, *, status: int = 0) -> str:
    result = CliRunner().invoke(app, [*shlex.split(command), "--server", address])
    assert result.exit_code == status, (command, result.output, result.exception)
    return result.stdout


def doctor(server: Running, address: str, data: Path) -> None:
    found = json.loads(run("doctor --json", address))["checks"]
    assert {found[name]["level"] for name in ("events", "views", "rig")} == {"ok"}


def still(server: Running, address: str, data: Path) -> None:
    kept = json.loads(run(f"still --json --data {data} --camera wide", address))
    assert server.get(f"/stills/{kept['id']}").status_code == 200


def capture(server: Running, address: str, data: Path) -> None:
    options = f"--json --data {data}"
    estimate = json.loads(run(f"capture --estimate {options} --name none {GRID}", address))
    assert estimate["points"] == 2
    taken = json.loads(run(f"capture {options} --name taken {GRID}", address))
    with gated() as gate:
        job = server.post("/captures", {"name": "cut", "plan": taken["plan"]}).json()
        opener = threading.Thread(target=open_when_cancelled, args=(server, job["id"], gate))
        opener.start()
        run(f"capture --cancel {options} --name cut", address)
        opener.join()
    job = server.post(f"/captures/{server.get('/captures', text='cut').json()[0]['id']}/resume").json()
    run(f"capture --watch {options} --name cut", address)
    assert server.ended(job)["state"] == "succeeded"


def open_when_cancelled(server: Running, job_id: str, gate: threading.Event) -> None:
    server.poll(f"/jobs/{job_id}", lambda found: found["state"] == "cancelling")
    gate.set()


def look(server: Running, address: str, data: Path) -> None:
    found = json.loads(run(f"look 720 540 --json --data {data}", address))
    assert server.get(f"/fixations/{found['id']}").json()["distance_m"] == found["distance_m"]


def confirm_zero(server: Running, address: str, data: Path) -> None:
    result = CliRunner().invoke(app, ["confirm-zero", "rail", "--server", address])
    assert "it has reference switches; home it" in str(result.exception)  # the server's own words


COMMANDS: dict[str, Callable[[Running, str, Path], None]] = {
    "doctor": doctor,
    "still": still,
    "capture": capture,
    "confirm-zero": confirm_zero,
    "look": look,
}


def commands_with_a_server(group: TyperGroup, *, words: str = "") -> set[str]:
    """Return the names of all commands that have the option `--server`."""
    found: set[str] = set()
    for name, command in group.commands.items():
        if isinstance(command, TyperGroup):
            found |= commands_with_a_server(command, words=f"{words}{name} ")
        elif any("--server" in option.opts for option in command.params):
            found.add(f"{words}{name}")
    return found


def test_no_command_with_a_server_is_left_out() -> None:
    program = typer.main.get_command(app)
    assert isinstance(program, TyperGroup)
    assert commands_with_a_server(program) == set(COMMANDS)


@pytest.mark.parametrize("path", ["/events", "/views/wide/stream.mjpeg", "/audit.jsonl"])
def test_what_has_no_length_is_not_collected_by_proxies(below: Running, path: str) -> None:
    with below.http.stream("GET", f"{API}{path}") as answer:
        assert answer.headers["x-accel-buffering"] == "no"
    assert "x-accel-buffering" not in below.get("/rig").headers


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_reaches_the_server_below_its_path(
    command: str, below: Running, nginx: Nginx, tmp_path: Path
) -> None:
    COMMANDS[command](below, f"http://127.0.0.1:{nginx.port}{ROOT}", tmp_path)


def test_a_proxy_may_strip_the_path_and_an_address_may_end_with_a_slash(
    below: Running, nginx: Nginx, tmp_path: Path
) -> None:
    for port, end in ((nginx.stripping_port, ""), (nginx.port, "/")):
        confirm_zero(below, f"http://127.0.0.1:{port}{ROOT}{end}", tmp_path)
