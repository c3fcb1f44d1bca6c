"""Serves the files of the browser's pages, and what they load: console, views, calibration display, REST."""

import hashlib
import time
from functools import lru_cache
from pathlib import Path

import fastapi_offline
from fastapi import FastAPI
from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse
from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

import foveacam_web
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs

router = GuardedRouter(include_in_schema=False, reading=Right.VIEW, changing=Right.ADMINISTER)

STATIC = Path(foveacam_web.__file__).parent / "static"
SWAGGER = Path(fastapi_offline.__file__).parent / "static"
"""Swagger UI, as that package ships it."""

NO_STALE_PAGES = {"Cache-Control": "no-cache"}
"""The browser validates its copy each time, so that page and server are of one version."""
FOR_GOOD = {"Cache-Control": "public, max-age=31536000, immutable"}


def version(folder: Path = STATIC) -> str:
    """Return a version that changes with any of the files and is part of the URLs of all that a page loads.

    So modules of two versions never mix, and browsers can cache each file for good.
    """
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        status = path.stat()
        digest.update(f"{path.relative_to(folder)}\0{status.st_mtime_ns}\0{status.st_size}\0".encode())
    return f"v-{digest.hexdigest()[:12]}"


@lru_cache(maxsize=1)
def _version_in(second: int) -> str:  # cached for one second
    return version()


class _VersionedFiles(StaticFiles):
    """Files that a browser caches for good under their version's URL, and revalidates under others."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        first, _, rest = path.partition("/")
        versioned = first.startswith("v-")
        response = await super().get_response(rest if versioned else path, scope)
        response.headers.update(
            FOR_GOOD if versioned and first == _version_in(int(time.monotonic())) else NO_STALE_PAGES
        )
        return response


@router.get("/")
@needs(Right.VIEW, takes_token=True)
def console() -> HTMLResponse:
    """Return the console."""
    return _page("index.html")


@router.get("/view")
def video_pane() -> HTMLResponse:
    """Return the video pane alone, for the panel in the 3D pane."""
    return _page("view.html")


@router.get("/windows")
def window() -> HTMLResponse:
    """Return the page that shows any views, divided as its address says."""
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
    text = (STATIC / name).read_text(encoding="utf-8")
    return HTMLResponse(text.replace('"/static/', f'"/static/{version()}/'), headers=NO_STALE_PAGES)


def install(app: FastAPI) -> None:
    """Serve the pages and the files that they load; first, as they are requested most."""
    seen = needs(Right.VIEW)
    app.mount("/docs/parts", seen(StaticFiles(directory=SWAGGER)), name="swagger")
    app.mount("/static", seen(_VersionedFiles(directory=STATIC, check_dir=False)), name="static")
    app.include_router(router)
