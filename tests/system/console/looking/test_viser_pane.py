"""The 3D pane in a real browser: through the relay, under the page's own policy, clicked and reconnecting."""

import math
import threading
from collections.abc import Iterator

import numpy as np
import pytest
from fastapi import FastAPI
from fastapi.responses import HTMLResponse
from fastapi.staticfiles import StaticFiles
from playwright.sync_api import Browser, Page, Route, ViewportSize, expect

from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_server.console import security, viser_relay
from foveacam_server.console.static_files import STATIC
from foveacam_server.doors import error_handlers
from foveacam_server.foundation.http.provided import ServiceRegistry
from foveacam_server.foundation.persons.person_quota import ServerPlaces
from foveacam_server.foundation.settings import Settings
from foveacam_server.rig.ports import SceneViewer
from foveacam_web.scene import ViewerScene
from foveacam_web.scene_values import FixationDrawing, Point, RigShape
from tests.support.pages.awaited import let_run, wait_for
from tests.support.pages.console_page import PATIENCE_MS, PHONE
from tests.support.servers.local_server import serving
from tests.support.servers.viewer import viewer_of

pytestmark = pytest.mark.browser

SIZE: ViewportSize = {"width": 900, "height": 600}
COUNT_DRAWINGS = """{
window.drawings = 0;
const { clear } = WebGL2RenderingContext.prototype;
WebGL2RenderingContext.prototype.clear = function (mask) { window.drawings++; clear.call(this, mask); };
}"""


def wall(distance_m: float) -> DepthMesh:
    """Return a square of 2 m by 2 m that faces the rig."""
    corners_m = [(-1, -1, distance_m), (1, -1, distance_m), (1, 1, distance_m), (-1, 1, distance_m)]
    return DepthMesh(
        vertices_rig_m=np.array(corners_m, dtype=np.float32),
        faces=np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32),
        uv=np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float32),
        texture=np.full((16, 16, 3), (20, 200, 40), dtype=np.uint8),
    )


def drawn(label: str, point_rig_m: Point, *, distance_m: float) -> FixationDrawing:
    return FixationDrawing(
        label=label,
        point_rig_m=point_rig_m,
        distance_m=distance_m,
        distance_sigma_m=0.01,
        mesh=wall(point_rig_m[2]),
    )


@pytest.fixture
def scene() -> Iterator[ViewerScene]:
    with ViewerScene() as opened:
        angle_rad = math.radians
        opened.show_rig(
            RigShape(
                baseline_m=0.2,
                wide_fov_rad=(angle_rad(25.6), angle_rad(19.4)),
                fovea_fov_rad=(angle_rad(2.86), angle_rad(2.15)),
            )
        )
        opened.show_fixation("fix-1", drawn("Wall", (0.0, 0.0, 3.0), distance_m=3.0))
        yield opened


@pytest.fixture
def port(scene: ViewerScene) -> Iterator[int]:
    app = FastAPI()
    app.state.provided = ServiceRegistry({SceneViewer | None: scene})
    app.state.places = ServerPlaces()
    error_handlers.install(app)
    security.install(app, Settings())
    app.include_router(viser_relay.router)
    app.mount("/static", StaticFiles(directory=STATIC))

    @app.get("/view", response_class=HTMLResponse)
    async def view() -> str:
        return "<!doctype html><title>views</title><p>the views"

    @app.get("/", response_class=HTMLResponse)
    async def console() -> str:
        return '<!doctype html><title>console</title><button>here</button><iframe src="/viser/?embedded=1">'

    with serving(app) as served:
        yield served


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    opened = browser.new_page(viewport={"width": SIZE["width"], "height": SIZE["height"]})
    opened.set_default_timeout(PATIENCE_MS)
    yield opened
    opened.close()


def test_the_pane_draws_and_a_click_on_a_surface_selects_it(
    scene: ViewerScene, port: int, page: Page
) -> None:
    complaints: list[str] = []
    page.on("console", lambda line: complaints.append(line.text) if line.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(f"http://127.0.0.1:{port}/viser/")
    wait_for(page, lambda: len(viewer_of(scene).get_clients()) == 1)
    wait_for(page, lambda: any(frame.url.endswith("/view") for frame in page.frames))

    def click() -> bool:
        # Between the docked and the floating panel, above the rig: the wall fills the middle of the canvas
        page.mouse.click(545, 200)
        page.wait_for_timeout(500)
        return scene._selected == "fix-1"

    wait_for(page, click)
    assert complaints == []


@pytest.mark.parametrize("size", [SIZE, PHONE], ids=["window", "phone"])
def test_stop_stands_above_the_pane_and_its_panels(
    scene: ViewerScene, port: int, page: Page, size: ViewportSize
) -> None:
    page.set_viewport_size(size)
    asked: list[str] = []

    def answer(route: Route) -> None:
        asked.append(route.request.method)
        if len(asked) < 3:
            route.fulfill(json={"engaged": True, "parked": len(asked) == 1})
        else:
            route.abort()

    page.route("**/api/v1/stop", answer)
    page.goto(f"http://127.0.0.1:{port}/viser/")
    wait_for(page, lambda: len(viewer_of(scene).get_clients()) == 1)
    stop, note = page.locator("#stop"), page.locator("#stopped")
    expect(note).to_be_hidden()
    stop.click()  # fails where anything covers its middle
    expect(note).to_contain_text("the mirrors are parked")
    expect(note.get_by_role("link")).to_have_attribute("href", "/")
    page.locator("canvas[data-engine]").click(position={"x": 60, "y": 300})
    page.keyboard.press("Space")
    expect(note).to_contain_text("the mirrors did not confirm")
    page.keyboard.press("Space")
    expect(note).to_contain_text("Not stopped from here")
    assert asked == ["POST"] * 3


def test_inside_the_console_the_pane_has_no_stop_of_its_own(
    scene: ViewerScene, port: int, page: Page
) -> None:
    page.goto(f"http://127.0.0.1:{port}/viser/?embedded=1")
    wait_for(page, lambda: len(viewer_of(scene).get_clients()) == 1)
    expect(page.locator("#stop")).to_have_count(0)


def test_inside_the_console_nothing_is_drawn_while_nothing_changes(
    scene: ViewerScene, port: int, page: Page
) -> None:
    page.add_init_script(COUNT_DRAWINGS)
    page.goto(f"http://127.0.0.1:{port}/viser/?embedded=1")
    wait_for(page, lambda: len(viewer_of(scene).get_clients()) == 1)

    def rests() -> bool:
        drawings: int = page.evaluate("window.drawings")
        let_run(page, 2500)  # longer than viser's own period
        later: int = page.evaluate("window.drawings")
        return 0 < drawings == later

    wait_for(page, rests)


def test_the_camera_goes_to_each_new_shape_until_the_person_moves_it_and_comes_back_when_asked(
    scene: ViewerScene, port: int, page: Page
) -> None:
    page.goto(f"http://127.0.0.1:{port}/viser/?embedded=1")
    wait_for(page, lambda: len(viewer_of(scene).get_clients()) == 1)
    (viewer,) = viewer_of(scene).get_clients().values()
    let_run(page, 2000)  # the page still places its camera at first

    def looks_at(point_m: Point) -> bool:
        return bool(np.allclose(viewer.camera.look_at, point_m, atol=0.05))

    scene.show_fixation("fix-2", drawn("Box", (0.4, 0.0, 2.0), distance_m=2.0))
    wait_for(page, lambda: looks_at((0.0, 0.0, 2.0)))  # the middle of its shape
    let_run(page, 1000)
    page.mouse.move(450, 300)
    page.mouse.down()
    page.mouse.move(300, 250, steps=4)
    page.mouse.up()
    wait_for(page, lambda: scene._viewpoints.has_moved(viewer))
    scene.show_fixation("fix-3", drawn("Far", (-0.5, 0.1, 6.0), distance_m=6.0))
    turned = np.array(viewer.camera.look_at)
    scene.show_surroundings(wall(5.0), wall(9.0), bring=True)  # somebody's look around
    let_run(page, 1500)
    assert looks_at((float(turned[0]), float(turned[1]), float(turned[2])))
    scene.remove_surroundings()
    page.locator("body").press("Alt+r")
    wait_for(page, lambda: bool(np.allclose(viewer.camera.position, 0.0, atol=0.01)))
    scene.show_fixation("fix-4", drawn("Near", (0.1, 0.1, 1.5), distance_m=1.5))
    wait_for(page, lambda: looks_at((0.0, 0.0, 1.5)))


def test_inside_the_console_the_panels_are_folded_and_the_views_not_loaded_again(
    scene: ViewerScene, port: int, page: Page
) -> None:
    page.goto(f"http://127.0.0.1:{port}/viser/?embedded=1")
    wait_for(page, lambda: len(viewer_of(scene).get_clients()) == 1)
    panel = page.locator('[data-testid="floating-panel"] [data-dock-minimize]')
    expect(panel).to_have_attribute("aria-expanded", "false")
    expect(page.locator('[data-dock-region-collapse="left"]')).to_have_count(0)
    canvas = page.locator("canvas[data-engine]")
    whole = (0, SIZE["width"])
    wait_for(page, lambda: (box := canvas.bounding_box()) is not None and (box["x"], box["width"]) == whole)
    assert not any(frame.url.endswith("/view") for frame in page.frames)


def test_a_frame_without_focus_reconnects_when_the_pane_comes_back(
    scene: ViewerScene, port: int, page: Page
) -> None:
    page.goto(f"http://127.0.0.1:{port}/")
    wait_for(page, lambda: len(viewer_of(scene).get_clients()) == 1)
    page.get_by_role("button", name="here").click()
    gone = threading.Event()

    @viewer_of(scene).on_client_disconnect
    async def _(_client: object) -> None:
        gone.set()

    viewer_of(scene)._websock_server.disconnect_all_clients()
    wait_for(page, gone.is_set)
    wait_for(page, lambda: len(viewer_of(scene).get_clients()) == 1)


def test_viewers_are_brought_to_what_was_seen_last(scene: ViewerScene, port: int, page: Page) -> None:
    page.goto(f"http://127.0.0.1:{port}/viser/")
    wait_for(page, lambda: len(viewer_of(scene).get_clients()) == 1)
    scene.show_fixation("fix-2", drawn("Farther wall", (1.0, 0.0, 8.0), distance_m=8.06))
    (viewer,) = viewer_of(scene).get_clients().values()

    def arrived() -> bool:  # as the browser tells it back
        before = bool(viewer.camera.position[2] < 8.0)
        return before and bool(np.allclose(viewer.camera.look_at, (0.0, 0.0, 8.0), atol=0.1))

    wait_for(page, arrived)
