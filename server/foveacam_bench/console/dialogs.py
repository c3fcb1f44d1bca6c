"""The dialogs of the console and how each is opened, and whether one click on STOP stops while it is open.

Left out: the account's dialog, which needs users, and that of a browser that was signed out, which may not
stop.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from foveacam_bench.console.pages import go_to, open_sized_page
from foveacam_bench.figures import Figures, Report
from foveacam_bench.progress import show_note
from foveacam_bench.servers import ServerProcess
from foveacam_bench.stream.console_page import open_context, wait_until

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SIZES = {"desktop": (1440, 900), "phone": (390, 844)}
"""Width and height of the window, CSS px."""
MODAL = "dialog:modal"
STOP_PATIENCE_MS, POLL_MS = 3000, 50
CAPTURE = {
    "name": "point",
    "plan": {
        "points": {"kind": "grid", "columns": 1, "rows": 1},
        "verging": {"mode": "given", "distance_m": 4.0},
    },
}
"""One point, for the dialog that shows a point."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConsoleDialog:
    """A modal dialog. `open`: opens it in a page of the console as a person does."""

    name: str
    open: Callable[["Page"], None]


def open_help(page: "Page") -> None:
    """Open the list of keys and gestures."""
    page.get_by_role("button", name="Help (?)").click()


def open_settings(page: "Page") -> None:
    """Open the settings of this browser."""
    page.get_by_role("button", name="More").click()
    page.get_by_role("button", name="Settings").click()


def open_control(page: "Page") -> None:
    """Open the dialog of who moves the mirrors."""
    page.get_by_role("button", name="Control is free").click()


def open_faults(page: "Page") -> None:
    """Open the tray of faults and warnings."""
    page.get_by_role("button", name="Faults and warnings").click()


def open_palette(page: "Page") -> None:
    """Open the command palette."""
    page.keyboard.press("Control+k")


def open_calibrate_everything(page: "Page") -> None:
    """Open the dialog that starts a whole calibration."""
    go_to(page, "#/calibration")
    page.get_by_role("button", name="Calibrate everything").click()


def open_calibration_import(page: "Page") -> None:
    """Open the question about a calibration file of the authors."""
    go_to(page, "#/calibration")
    file = json.dumps({"schema": "fovea-device-config"}).encode()
    page.get_by_label("Import a calibration file").set_input_files(
        {"name": "authors.json", "mimeType": "application/json", "buffer": file}
    )


def open_map_scale(page: "Page") -> None:
    """Open the question about the scale of a map."""
    go_to(page, "#/planner")
    page.locator(".planner .segments label", has_text="Picture").click()
    _, png = cv2.imencode(".png", np.full((300, 400), 255, np.uint8))
    page.get_by_label("Load a picture").set_input_files(
        {"name": "map.png", "mimeType": "image/png", "buffer": png.tobytes()}
    )


def open_question(page: "Page") -> None:
    """Open a question with Cancel: whether to open another scene."""
    go_to(page, "#/setup")
    page.get_by_label("Scene of the simulated rig").select_option("street")


def open_point(page: "Page") -> None:
    """Open the pictures of a point of a dataset."""
    go_to(page, "#/gallery")
    page.locator(".card h3 a").first.click()
    page.locator(".cells button").first.click()


ON_EVERY_PAGE = (
    ConsoleDialog(name="help", open=open_help),
    ConsoleDialog(name="settings", open=open_settings),
    ConsoleDialog(name="control", open=open_control),
    ConsoleDialog(name="faults", open=open_faults),
    ConsoleDialog(name="palette", open=open_palette),
)
DIALOGS = (
    *ON_EVERY_PAGE,
    ConsoleDialog(name="calibrate everything", open=open_calibrate_everything),
    ConsoleDialog(name="calibration import", open=open_calibration_import),
    ConsoleDialog(name="scale of a map", open=open_map_scale),
    ConsoleDialog(name="question", open=open_question),
    ConsoleDialog(name="point of a dataset", open=open_point),
)
QUICK_DIALOGS = ON_EVERY_PAGE[:2]


def stop_figures(browser: "Browser", server: ServerProcess, *, quick: bool, report: Report) -> Figures:
    """Open each dialog on a desktop and on a phone and click on STOP once; return where that stopped.

    `quick`: two dialogs, on a desktop.
    """
    dialogs = QUICK_DIALOGS if quick else DIALOGS
    if any(dialog.open is open_point for dialog in dialogs):
        server.send("POST", "/captures", CAPTURE, {"Prefer": "wait=60"})
    missed: list[str] = []
    for size, (width, height) in list(SIZES.items())[: 1 if quick else None]:
        report(f"STOP beside dialogs, {size}")
        with open_context(browser, scene=False) as context:
            page = open_sized_page(context, server.url, width=width, height=height)
            missed += [f"{size}: {name}" for name in _missed(page, server, dialogs)]
    for line in missed:
        show_note(f"one click on STOP does not stop, {line}")
    return {"stop_one_click": not missed, "stop_dialogs": len(dialogs)}


def _missed(page: "Page", server: ServerProcess, dialogs: Sequence[ConsoleDialog]) -> list[str]:
    """Return the names of the dialogs beside which one click did not stop."""
    missed = []
    for dialog in dialogs:
        go_to(page, "#/")
        dialog.open(page)
        page.locator(MODAL).wait_for()
        if not one_click_stops(page, lambda: bool(server.send("GET", "/stop").json()["engaged"])):
            missed.append(dialog.name)
        server.send("DELETE", "/stop")
        page.keyboard.press("Escape")
        wait_until(page, lambda: page.locator(MODAL).count() == 0)
        page.locator("#stopped").wait_for(state="hidden")
    return missed


def one_click_stops(page: "Page", engaged: Callable[[], bool]) -> bool:
    """Click once on the middle of STOP, whatever is above it; return whether the stop is engaged then."""
    box = page.locator("#stop").bounding_box()
    if box is None:
        return False
    page.mouse.click(box["x"] + box["width"] / 2.0, box["y"] + box["height"] / 2.0)
    for _ in range(STOP_PATIENCE_MS // POLL_MS):
        if engaged():
            return True
        page.wait_for_timeout(POLL_MS)
    return False
