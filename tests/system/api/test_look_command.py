"""`foveacam look`: the same answer and the same shape from a running server and from a rig of its own."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from foveacam_client import PointCloud
from foveacam_server import cli
from tests.support.servers.running_server import Running

pytestmark = pytest.mark.timeout(300)

MIDDLE = ("719.5", "539.5")
Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Run `foveacam look`; return its status and what it printed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FOVEACAM_DATA", str(tmp_path / "data"))

    def call(*words: str) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["foveacam", "look", *words])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        assert isinstance(ended.value.code, int)
        told = capsys.readouterr()
        return ended.value.code, told.out, told.err

    return call


@pytest.fixture
def address(api_server: Running) -> str:
    return f"http://127.0.0.1:{api_server.port}"


def points_of(path: Path) -> int:
    return len(PointCloud(path.read_bytes()).points_rig_m)


def test_a_server_looks_and_its_shape_is_saved(
    api_server: Running, run: Run, address: str, tmp_path: Path
) -> None:
    status, printed, told = run(*MIDDLE, "--server", address, "--save", "cloud.ply")
    assert (status, told) == (0, "")
    lines = printed.splitlines()
    kept = api_server.get("/fixations", limit=1).json()[0]
    distance_m, sigma_m = (float(word) for word in lines[0].removesuffix(" m").split(" ± "))
    assert distance_m == pytest.approx(kept["distance_m"], abs=sigma_m)
    assert lines[1] == "Measured by both foveae: left against right, confirmed by the wide view."
    assert lines[-1].startswith("cloud.ply: ")
    assert points_of(tmp_path / "cloud.ply") > 10_000

    assert run(*MIDDLE, "--server", address, "--save", "mesh.glb")[0] == 0
    assert (tmp_path / "mesh.glb").read_bytes().startswith(b"glTF")


def test_the_fixation_of_a_server_is_printed_as_by_rest(api_server: Running, run: Run, address: str) -> None:
    status, printed, told = run(*MIDDLE, "--server", address, "--json")
    assert (status, told) == (0, "")
    found: dict[str, Any] = json.loads(printed)
    kept = api_server.get(f"/fixations/{found['id']}").json()
    assert {key: kept[key] for key in found} == found
    assert found["request"]["pixel"] == {"x_px": 719.5, "y_px": 539.5}


def test_what_a_server_refuses_is_one_line(run: Run, address: str) -> None:
    status, printed, told = run("2000", "540", "--server", address)
    assert (status, printed, told.count("\n")) == (2, "", 1)
    assert "2000" in told


def test_a_rig_of_its_own_measures_the_same_place(run: Run, address: str, tmp_path: Path) -> None:
    by_server = json.loads(run(*MIDDLE, "--server", address, "--json")[1])

    status, printed, told = run(*MIDDLE, "--json", "--save", "own.ply")

    assert (status, told) == (0, "")
    own = json.loads(printed)
    assert own["basis"] == "both_foveae"
    assert own["distance_m"] == pytest.approx(
        by_server["distance_m"], abs=4.0 * (own["distance_sigma_m"] + by_server["distance_sigma_m"])
    )
    assert (own["job_id"], own["target_id"], own["cloud_id"]) == ("", None, None)
    assert points_of(tmp_path / "own.ply") > 10_000
