"""The 3D pane of the console: its scene in a frame, and the checkboxes of its folded panel."""

from typing import TYPE_CHECKING

from foveacam_bench.stream.console_page import PATIENCE_S

if TYPE_CHECKING:
    from playwright.sync_api import FrameLocator, Page

# events in place of keys, since the console takes the focus back from a frame without the pointer
_PRESS_ENTER = "(box) => box.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter', bubbles: true}))"
_SET = "(box, on) => { if (box.checked !== on) box.click(); }"


def open_scene(page: "Page") -> "FrameLocator":
    """Return the 3D scene of a console once it draws."""
    scene = page.frame_locator("#scene iframe")
    scene.locator("canvas[data-engine]").wait_for(timeout=1e3 * PATIENCE_S)
    return scene


def set_shown(scene: "FrameLocator", label: str, *, shown: bool) -> None:
    """Set a checkbox of the scene's panel, which is unfolded for it alone."""
    scene.locator("[data-dock-minimize][aria-expanded=false]").evaluate(_PRESS_ENTER)
    box = scene.get_by_label(label, exact=True)
    box.wait_for(state="attached")
    box.evaluate(_SET, shown)
    scene.locator("[data-dock-minimize][aria-expanded=true]").evaluate(_PRESS_ENTER)
