import asyncio
import math
import socket
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest
from tests.support.servers.viewer import viewer_of
from viser import LineSegmentsHandle

from foveacam_hardware.contract import NotConnected
from foveacam_pipeline.stereo.values import Cloud, DepthMesh
from foveacam_pipeline.verge.values import Basis
from foveacam_web import scene as scene_module
from foveacam_web import viser_server
from foveacam_web.scene import MAX_FIXATIONS, ViewerScene
from foveacam_web.scene_fixation import LIVE_POINTS, FixationNode, FixationParts, thin
from foveacam_web.scene_labels import MOST, free_labels
from foveacam_web.scene_lines import trail_segments
from foveacam_web.scene_rig import frustum_scale, gaze_direction, rig_from_gaze
from foveacam_web.scene_values import (
    EyeGaze,
    FixationDrawing,
    LimitsDrawing,
    MeasurementDrawing,
    Point,
    RigShape,
)
from foveacam_web.viser_page import viser_page

SHAPE = RigShape(
    baseline_m=0.2,
    wide_fov_rad=(math.radians(25.6), math.radians(19.4)),
    fovea_fov_rad=(math.radians(2.86), math.radians(2.15)),
)


def cloud(points: int, *, centre_m: tuple[float, float, float] = (0.3, -0.1, 12.0)) -> Cloud:
    rng = np.random.default_rng(5)
    return Cloud(
        points_rig_m=rng.normal(centre_m, 0.05, (points, 3)).astype(np.float32),
        colors=rng.integers(0, 256, (points, 3), dtype=np.uint8),
        sigma_m=np.full(points, 0.01, dtype=np.float32),
    )


def mesh() -> DepthMesh:
    return DepthMesh(
        vertices_rig_m=np.array([[0, 0, 3], [0.1, 0, 3], [0, 0.1, 3]], dtype=np.float32),
        faces=np.array([[0, 1, 2]], dtype=np.uint32),
        uv=np.array([[0, 0], [1, 0], [0, 1]], dtype=np.float32),
        texture=np.full((8, 8, 3), 90, dtype=np.uint8),
    )


@pytest.fixture
def scene() -> Iterator[ViewerScene]:
    with ViewerScene() as opened:
        yield opened


def show(scene: ViewerScene, name: str, *, with_cloud: bool = True, with_mesh: bool = True) -> None:
    drawing = FixationDrawing(
        label=name,
        point_rig_m=(0.3, -0.1, 12.0),
        distance_m=12.004,
        distance_sigma_m=0.031,
        cloud=cloud(300) if with_cloud else None,
        mesh=mesh() if with_mesh else None,
    )
    scene.show_fixation(name, drawing)


def fixation_in(scene: ViewerScene, name: str) -> FixationNode:
    found = scene._fixations[name]
    assert isinstance(found, FixationNode)
    return found


def nodes(scene: ViewerScene) -> set[str]:
    return set(viewer_of(scene).scene._handle_from_node_name)


@pytest.mark.parametrize(("ax_deg", "ay_deg"), [(0.0, 0.0), (9.0, -7.0), (-10.0, 10.0)])
def test_a_frustum_points_along_the_gaze_and_stays_level(ax_deg: float, ay_deg: float) -> None:
    gaze = EyeGaze(ax_rad=math.radians(ax_deg), ay_rad=math.radians(ay_deg))
    rotation = rig_from_gaze(gaze)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    np.testing.assert_allclose(rotation[:, 2], gaze_direction(gaze), atol=1e-12)
    assert rotation[1, 0] == pytest.approx(0.0)
    x, y, z = gaze_direction(gaze)
    assert (math.degrees(math.atan2(x, z)), math.degrees(math.atan2(y, z))) == pytest.approx((ax_deg, ay_deg))


@pytest.mark.parametrize("fov_deg", [(25.6, 19.4), (2.86, 2.15)])
def test_a_frustum_is_as_deep_as_asked(fov_deg: tuple[float, float]) -> None:
    # viser's client: (x, y, z) = (tan h/2, tan v/2, 1) * scale / cbrt(x y z / 3)
    fov_rad = (math.radians(fov_deg[0]), math.radians(fov_deg[1]))
    x, y = math.tan(fov_rad[0] / 2), math.tan(fov_rad[1] / 2)
    assert frustum_scale(fov_rad, depth_m=2.5) / math.cbrt(x * y / 3) == pytest.approx(2.5)


def test_the_label_shows_the_digits_that_the_error_leaves() -> None:
    def text(sigma_m: float) -> str:
        return FixationDrawing(
            label="T1", point_rig_m=(0, 0, 3), distance_m=3.21469, distance_sigma_m=sigma_m
        ).text

    assert text(0.004) == "T1  3.215 ± 0.004 m"
    assert text(0.03) == "T1  3.21 ± 0.03 m"
    assert text(0.4) == "T1  3.2 ± 0.4 m"
    assert text(0.00002) == "T1  3.21469 ± 0.00002 m"


def test_a_long_name_is_cut_in_the_scene_so_that_neighbours_stay_readable() -> None:
    drawing = FixationDrawing(
        label="the third bolt from the left", point_rig_m=(0, 0, 3), distance_m=3.0, distance_sigma_m=0.004
    )
    assert drawing.text == "the third bolt from the…  3.000 ± 0.004 m"


def test_a_large_cloud_is_thinned_over_its_whole_extent() -> None:
    full = cloud(LIVE_POINTS + 5_000)
    points_m, colors = thin(full)
    assert points_m.shape == colors.shape == (LIVE_POINTS, 3)
    np.testing.assert_array_equal(points_m[[0, -1]], full.points_rig_m[[0, -1]])


def test_the_scene_works_while_nobody_watches(scene: ViewerScene) -> None:
    scene.show_rig(SHAPE)
    gaze = EyeGaze(ax_rad=0.02, ay_rad=-0.01)
    scene.show_gaze(left=gaze, right=gaze, distance_m=4.0)
    show(scene, "fix-1")
    scene.select("fix-1")
    expected = {"/rig", "/cameras/wide", "/cameras/left", "/cameras/right", "/gaze/left", "/floor"}
    expected |= {f"/fixations/fix-1/{part}" for part in ("cloud", "surface", "marker", "label", "sigma")}
    assert expected <= nodes(scene)


def test_eyes_whose_gaze_nobody_knows_are_hidden_until_it_is_known_again(scene: ViewerScene) -> None:
    scene.show_rig(SHAPE)
    drawn = scene._rig
    assert drawn is not None
    gaze = EyeGaze(ax_rad=0.02, ay_rad=-0.01)
    visible = []
    for left in (gaze, None, gaze):
        scene.show_gaze(left=left, right=gaze)
        visible.append([part["left"].visible for part in (drawn._eyes, drawn._rays)])
    assert visible == [[True, True], [False, False], [True, True]]
    assert drawn._eyes["right"].visible

    scene.show_gaze(left=None, right=gaze)
    drawn.show_rays(visible=True)
    assert not drawn._rays["left"].visible


def test_a_cloud_is_sent_around_its_own_centre(scene: ViewerScene) -> None:
    show(scene, "fix-1")
    node = fixation_in(scene, "fix-1")._cloud
    assert node is not None
    np.testing.assert_allclose(node.position, (0.3, -0.1, 12.0), atol=0.02)
    restored_m = np.asarray(node.points, dtype=np.float64) + node.position
    # Half floats within 0.25 m of the centre: steps of 2^-13 m
    np.testing.assert_allclose(restored_m, cloud(300).points_rig_m, atol=2**-13)


def test_showing_a_fixation_again_replaces_it(scene: ViewerScene) -> None:
    show(scene, "fix-1")
    show(scene, "fix-1", with_mesh=False)
    assert tuple(scene._fixations) == ("fix-1",)
    assert "/fixations/fix-1/surface" not in nodes(scene)


def test_a_cloud_without_a_surface_is_shown(scene: ViewerScene) -> None:
    show(scene, "fix-1")
    with_surface = fixation_in(scene, "fix-1")._cloud
    assert with_surface is not None
    assert not with_surface.visible
    show(scene, "fix-2", with_mesh=False)
    alone = fixation_in(scene, "fix-2")._cloud
    assert alone is not None
    assert alone.visible


def test_a_removed_fixation_leaves_nothing(scene: ViewerScene) -> None:
    before = nodes(scene)
    show(scene, "fix-1")
    scene.remove_fixation("fix-1")
    scene.remove_fixation("never there")
    assert nodes(scene) - before <= {"/fixations"}
    assert tuple(scene._fixations) == ()


def test_the_oldest_fixation_makes_room_but_never_the_selected_one(scene: ViewerScene) -> None:
    show(scene, "fix-0", with_cloud=False, with_mesh=False)
    scene.select("fix-0")
    for index in range(1, MAX_FIXATIONS + 1):
        show(scene, f"fix-{index}", with_cloud=False, with_mesh=False)
    assert len(scene._fixations) == MAX_FIXATIONS
    assert tuple(scene._fixations)[:2] == ("fix-0", "fix-2")


def test_a_click_is_handed_over_to_the_servers_loop(scene: ViewerScene) -> None:
    show(scene, "fix-1")

    async def scenario() -> tuple[str, bool]:
        here = threading.current_thread()
        taken: asyncio.Future[tuple[str, bool]] = asyncio.get_running_loop().create_future()

        async def take(fixation_id: str) -> None:
            taken.set_result((fixation_id, threading.current_thread() is here))

        scene.on_select(take, asyncio.get_running_loop())
        viser_loop = viewer_of(scene).get_event_loop()
        asyncio.run_coroutine_threadsafe(scene._clicked("fix-1"), viser_loop)
        return await asyncio.wait_for(taken, timeout=5.0)

    assert asyncio.run(scenario()) == ("fix-1", True)
    assert scene._selected == "fix-1"


def test_stopping_leaves_no_thread() -> None:
    before = set(threading.enumerate())
    opened = ViewerScene()
    opened.start()
    show(opened, "fix-1")
    opened.stop()
    opened.stop()
    for thread in set(threading.enumerate()) - before:
        thread.join(timeout=5.0)
    assert set(threading.enumerate()) <= before


def test_a_stopped_scene_ignores_what_it_is_told() -> None:
    stopped = ViewerScene()
    show(stopped, "fix-1")
    stopped.show_rig(SHAPE)
    assert tuple(stopped._fixations) == ()
    with pytest.raises(RuntimeError, match="start"):
        _ = stopped.socket_path


def listening_ports() -> set[str]:
    """Return the local addresses of this machine on which TCP is listened."""
    lines = [
        line for table in ("tcp", "tcp6") for line in Path(f"/proc/net/{table}").read_text().splitlines()
    ]
    return {line.split()[1] for line in lines if line.split()[3] == "0A" and line.split()[9] in own_sockets()}


def own_sockets() -> set[str]:
    """Return the inodes of this process's sockets."""
    links = []
    for descriptor in Path("/proc/self/fd").iterdir():
        with suppress(OSError):  # closed meanwhile: the listing's own
            links.append(str(descriptor.readlink()))
    return {link.removeprefix("socket:[").removesuffix("]") for link in links if link.startswith("socket:[")}


def test_the_scene_opens_no_port_and_a_socket_that_its_owner_alone_can_reach() -> None:
    before = listening_ports()
    with ViewerScene() as opened:
        assert listening_ports() <= before
        path = opened.socket_path
        assert path.is_socket()
        assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    assert not path.parent.exists()


def test_a_viser_that_would_listen_at_a_port_does_not_stay_open(monkeypatch: pytest.MonkeyPatch) -> None:
    before = listening_ports()

    @contextmanager
    def without_effect(_listener: socket.socket) -> Iterator[list[socket.socket]]:
        yield []

    monkeypatch.setattr(viser_server, "_listening_on", without_effect)
    with pytest.raises(NotConnected, match="does not listen on the socket"):
        ViewerScene().start()
    assert listening_ports() <= before


def test_no_viewer_can_open_a_public_tunnel(
    scene: ViewerScene, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def tunnel(*_args: object) -> None:
        raise AssertionError("a tunnel was opened")

    monkeypatch.setattr("viser._viser.ViserTunnel", tunnel)
    assert viewer_of(scene).request_share_url() is None
    assert "refused" in caplog.text


def test_the_banner_of_viser_stays_off_the_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    with scene_module.ViewerScene():
        pass
    assert capfd.readouterr().out == ""


def test_the_page_reconnects_without_focus() -> None:
    page = viser_page().decode()
    head = page[: page.index("</head>")]
    assert "document.hasFocus = () => true" in head
    assert viser_page(bare=True) != viser_page()


def test_the_pane_of_the_console_paces_its_drawings_before_viser_starts() -> None:
    page = viser_page(bare=True).decode()
    head = page[: page.index("</head>")]
    assert "paceDrawing(window)" in head
    assert "data-p=" in head[head.index("paceDrawing(window)") :], "viser's own script comes later"
    assert "paceDrawing" not in viser_page().decode()


def test_label_says_how_a_distance_is_known_unless_both_foveae_measured_it() -> None:
    def text(basis: Basis) -> str:
        where = (0.0, 0.0, 2.0)
        return FixationDrawing(
            label="globe", point_rig_m=where, distance_m=2.0, distance_sigma_m=0.03, basis=basis
        ).text

    assert text(Basis.BOTH_FOVEAE) == "globe  2.00 ± 0.03 m"
    assert text(Basis.SURROUNDINGS) == "globe  2.00 ± 0.03 m (inferred)"


@pytest.mark.parametrize(
    ("farthest_m", "end_m", "text"), [(8.0, 8.0, "1.3 to 8.0 m"), (None, 3.9, "> 1.3 m")]
)
def test_limits_are_a_line_along_the_sight(farthest_m: float | None, end_m: float, text: str) -> None:
    drawing = LimitsDrawing(label="sky", direction_deg=(5.0, -3.0), nearest_m=1.3, farthest_m=farthest_m)
    ends_m = drawing.ends_rig_m()
    assert np.linalg.norm(ends_m, axis=1) == pytest.approx([1.3, end_m])
    assert np.cross(ends_m[0], ends_m[1]) == pytest.approx(np.zeros(3), abs=1e-12)
    assert drawing.text == f"sky  {text}"


def test_limits_stand_in_the_scene_until_removed(scene: ViewerScene) -> None:
    limits = LimitsDrawing(label="sky", direction_deg=(0.0, 0.0), nearest_m=1.3, farthest_m=None)
    scene.show_limits("sky", limits)
    scene.select("sky")
    assert list(scene._fixations) == ["sky"]
    scene.remove_fixation("sky")
    assert not list(scene._fixations)


def test_a_marker_on_a_shape_is_small_enough_to_leave_it_in_sight(scene: ViewerScene) -> None:
    show(scene, "alone", with_cloud=False, with_mesh=False)
    show(scene, "shaped", with_cloud=False)
    alone, shaped = (fixation_in(scene, name)._marker.radius for name in ("alone", "shaped"))
    assert shaped < 0.5 * alone


def test_a_renamed_fixation_has_its_new_name_above_it(scene: ViewerScene) -> None:
    show(scene, "T1")
    scene.show_limits(
        "fix-2", LimitsDrawing(label="T2", direction_deg=(0.0, 0.0), nearest_m=1.3, farthest_m=None)
    )
    before = fixation_in(scene, "T1").drawing.text
    scene.relabel_fixation("T1", "the globe")
    scene.relabel_fixation("fix-2", "the sky")
    scene.relabel_fixation("fix-9", "nothing")
    labels = [node._label.text for node in scene._fixations.values()]
    assert labels == [before.replace("T1", "the globe"), "the sky  > 1.3 m"]


def test_of_labels_that_would_cover_each_other_the_selected_s_or_the_newest_is_shown(
    scene: ViewerScene,
) -> None:
    def labelled() -> set[str]:
        return {name for name in scene._fixations if fixation_in(scene, name)._label.visible}

    names = ["fix-0", "fix-1", "fix-2"]  # in one place
    for name in names:
        show(scene, name, with_cloud=False, with_mesh=False)
    assert labelled() == {"fix-2"}
    scene.select("fix-0")
    assert labelled() == {"fix-0"}
    scene._show(FixationParts(labels=False))
    assert labelled() == set()


def test_labels_of_measurements_and_targets_do_not_cover_each_other_and_come_back_once_there_is_room(
    scene: ViewerScene,
) -> None:
    def labelled() -> set[str]:
        every = {**scene._fixations, **scene._measurements}
        return {name for name, node in every.items() if node._label.visible}

    def measure(name: str, *points_rig_m: Point) -> None:
        scene.show_measurement(name, MeasurementDrawing(label="0.06 m", points_rig_m=points_rig_m))

    show(scene, "fix-0", with_cloud=False, with_mesh=False)  # at (0.3, -0.1, 12)
    label_y_m = -0.1 - 0.021 * 12.0  # its label stands above it
    measure("msr-1", (0.2, label_y_m, 12.0), (0.4, label_y_m, 12.0))
    assert labelled() == {"msr-1"}
    measure("msr-2", (0.2, label_y_m, 12.0))
    measure("msr-far", (0.2, 1.0, 12.0))
    assert labelled() == {"msr-2", "msr-far"}
    scene.select("fix-0")
    assert labelled() == {"fix-0", "msr-far"}
    scene.remove_fixation("fix-0")
    assert labelled() == {"msr-2", "msr-far"}
    scene.remove_measurement("msr-2")
    assert labelled() == {"msr-1", "msr-far"}
    scene._show(FixationParts(labels=False))
    assert labelled() == set()


def test_labels_apart_are_shown_together_but_never_so_many_that_they_fill_the_view() -> None:
    apart = [(f"t{at}", (2.0 * math.tan(math.radians(21.0 * at)), 0.0, 2.0)) for at in range(-3, 4)]
    assert free_labels(apart[:3]) == {"t-3", "t-2", "t-1"}
    assert len(free_labels(apart)) == MOST
    above = [("low", (0.0, 0.1, 2.0)), ("high", (0.0, 0.0, 2.0)), ("covered", (0.01, 0.01, 2.0))]
    assert free_labels(above) == {"low", "high"}


def test_a_followed_target_leaves_a_trail_until_it_is_let_go(scene: ViewerScene) -> None:
    points = [(0.1 * step, 0.0, 8.0) for step in range(4)]
    scene.show_trail("fol-1", "walker", points[:1])
    assert {"/follows/fol-1/marker", "/follows/fol-1/label"} <= nodes(scene)
    assert "/follows/fol-1/line" not in nodes(scene)
    scene.show_trail("fol-1", "walker", points)
    line = viewer_of(scene).scene._handle_from_node_name["/follows/fol-1/line"]
    assert isinstance(line, LineSegmentsHandle)
    np.testing.assert_allclose(np.asarray(line.points), trail_segments(np.array(points)))
    assert trail_segments(np.array(points)).shape == (3, 2, 3)
    scene.remove_trail("fol-1")
    scene.remove_trail("fol-1")
    assert not any(name.startswith("/follows/fol-1") for name in nodes(scene))
