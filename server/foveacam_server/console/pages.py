"""Serves the browser's pages: console, views, calibration display, REST."""

import re
from functools import lru_cache
from pathlib import Path

import fastapi_offline
from fastapi import FastAPI
from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.console.module_graph import start_modules
from foveacam_server.console.static_files import (
    NO_STALE_PAGES,
    STATIC,
    CompressedFiles,
    VersionedFiles,
    version,
    with_joined_sheets,
)

router = GuardedRouter(include_in_schema=False, reading=Right.VIEW, changing=Right.ADMINISTER)

SWAGGER = Path(fastapi_offline.__file__).parent / "static"
"""Swagger UI, as that package ships it."""
_MODULE = re.compile(r'<script type="module" src="/static/([^"]+)"></script>')


@router.get("/")
@needs(Right.VIEW, takes_token=True)
def console() -> HTMLResponse:
    """Return the console."""
    return _page("index.html")


@router.get("/view")
def video_pane() -> HTMLResponse:
    """Return the video pane by itself, for the panel in the 3D pane."""
    return _page("view.html")


@router.get("/windows")
def window() -> HTMLResponse:
    """Return the page of views in the layout of its address."""
    return _page("windows.html")


@router.get("/replay")
def replay_window() -> HTMLResponse:
    """Return the page that shows panes of a recording, beside its player."""
    return _page("replay.html")


@router.get("/display")
def calibration_display() -> HTMLResponse:
    """Return the page that shows the calibration pattern at its true size."""
    return _page("display.html")


@router.get("/docs")
def interface() -> HTMLResponse:
    """Return the page about the REST interface, on which every operation can be tried."""
    return _page("docs.html")


@router.get("/redoc")
def other_interface() -> RedirectResponse:
    """Redirect to the page about the interface."""
    return RedirectResponse("/docs", status_code=308)


@router.get("/favicon.ico")
async def icon() -> FileResponse:
    """Return the icon that browsers request by themselves."""
    return FileResponse(STATIC / "icon.svg", media_type="image/svg+xml", headers=NO_STALE_PAGES)


def _page(name: str) -> HTMLResponse:
    return HTMLResponse(page_text(name), headers=NO_STALE_PAGES)


def page_text(name: str) -> str:
    """Return the HTML of a page, with the version of its files in their addresses."""
    current = version()
    return _complete_page(name, current).replace('"/static/', f'"/static/{current}/')


@lru_cache(maxsize=16)
def _complete_page(name: str, _version: str) -> str:
    """Return a page with one style sheet, and with links to the modules that its script imports at the start.

    With these links a browser requests all of them at once, instead of one level of imports after the other.
    """
    text = with_joined_sheets(name)
    entry = _MODULE.search(text)
    if entry is None:
        return text
    modules = start_modules(STATIC / entry[1])[1:]
    addresses = (module.relative_to(STATIC.resolve()).as_posix() for module in modules)
    links = "".join(f'  <link rel="modulepreload" href="/static/{address}">\n' for address in addresses)
    return text.replace("</head>", f"{links}</head>")


def install(app: FastAPI) -> None:
    """Serve the pages and their files; before all other routes, as they are requested most."""
    seen = needs(Right.VIEW)
    app.mount("/docs/parts", seen(CompressedFiles(directory=SWAGGER)), name="swagger")
    app.mount("/static", seen(VersionedFiles(directory=STATIC, check_dir=False)), name="static")
    app.include_router(router)
