"""Serves the files of the pages: compressed once each, cached by browsers under versioned addresses.

Style sheets that a page links one after another are joined into one, so that a page on a slow line waits
for a single file; those in a `<template>` are a second one, which the page fetches when it needs it.
"""

import gzip
import hashlib
import itertools
import re
import time
from functools import lru_cache
from pathlib import Path

from anyio import to_thread
from starlette.datastructures import Headers
from starlette.responses import FileResponse, Response
from starlette.staticfiles import NotModifiedResponse, StaticFiles
from starlette.types import Scope

import foveacam_web
from foveacam_server.doors.compression import accepts_gzip

STATIC = Path(foveacam_web.__file__).parent / "static"

NO_STALE_PAGES = {"Cache-Control": "no-cache"}
"""Cache header: the browser revalidates its copy each time, so that page and server have the same version."""
FOR_GOOD = {"Cache-Control": "public, max-age=31536000, immutable"}
JOINED = "joined/"
"""Folder in the address of a page's joined style sheets: `joined/0/index.html.css`; no such files exist."""

_TEXTS = frozenset({".css", ".html", ".js", ".json", ".map", ".svg", ".txt"})
_SMALLEST_BYTES = 500
"""Size below which files are not compressed: it would not save a packet."""
_FILES = 1024
_LEVEL = 9
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
"""A comment of a style sheet; all of them are 1.7 kB of what a browser fetches before its first picture."""
_SHEET = re.compile(r'<link rel="stylesheet" href="/static/(css/[^"]+)">\s*')
_RUN = re.compile(rf"(?:{_SHEET.pattern})+")
"""Links to style sheets one after another, to be joined."""


def version(folder: Path = STATIC) -> str:
    """Return a version that changes with any of the files and is part of all their URLs.

    So modules of two versions never mix, and browsers can cache each file indefinitely.
    """
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        status = path.stat()
        digest.update(f"{path.relative_to(folder)}\0{status.st_mtime_ns}\0{status.st_size}\0".encode())
    return f"v-{digest.hexdigest()[:12]}"


@lru_cache(maxsize=1)
def _version_in(second: int) -> str:  # cached for one second
    return version()


class CompressedFiles(StaticFiles):
    """Static files; texts are sent compressed to clients that accept it, except for range requests."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Answer a request for a file."""
        response = await super().get_response(path, scope)
        if Path(path).suffix in _TEXTS:
            response.headers.add_vary_header("Accept-Encoding")
        if not isinstance(response, FileResponse) or Path(response.path).suffix not in _TEXTS:
            return response
        asked, status = Headers(scope=scope), response.stat_result
        if "range" in asked or not accepts_gzip(asked) or status is None or status.st_size < _SMALLEST_BYTES:
            return response
        packed = await to_thread.run_sync(
            _packed_file, str(response.path), status.st_mtime_ns, status.st_size
        )
        return self._compressed(response, packed, asked)

    def _compressed(self, whole: FileResponse, packed: bytes, asked: Headers) -> Response:
        """Return the compressed answer; its own ETag, as its bytes are others (RFC 9110, 8.8.3.3)."""
        kept = {name: whole.headers[name] for name in ("content-type", "last-modified", "vary")}
        tag = whole.headers["etag"].removesuffix('"') + '-gzip"'
        response = Response(packed, headers=kept | {"content-encoding": "gzip", "etag": tag})
        return (
            NotModifiedResponse(response.headers)
            if self.is_not_modified(response.headers, asked)
            else response
        )


class VersionedFiles(CompressedFiles):
    """Files that a browser caches indefinitely under their versioned URL, and revalidates under others."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Answer a request for a file, or for all style sheets of a page in one."""
        first, _, rest = path.partition("/")
        versioned = first.startswith("v-")
        name = rest if versioned else path
        sheets = joined_at(name)
        if sheets is not None and scope["method"] in ("GET", "HEAD"):
            response = _sheet_response(sheets, scope)
        else:
            response = await super().get_response(name, scope)
        current = versioned and first == _version_in(int(time.monotonic()))
        response.headers.update(FOR_GOOD if current else NO_STALE_PAGES)
        return response


def page_names() -> set[str]:
    """Return the names of all pages."""
    return {path.name for path in STATIC.glob("*.html")}


def sheets_of(page: str) -> list[list[str]]:
    """Return the style sheets linked by a page, in their order: a list for each that joins them."""
    return [_SHEET.findall(run.group()) for run in _RUN.finditer(_text_of(page))]


def joined_at(address: str) -> str | None:
    """Return the style sheets that `address` joins, as one without comments; None if it joins none."""
    run, _, page = address.removeprefix(JOINED).removesuffix(".css").partition("/")
    if not address.startswith(JOINED) or page not in page_names():
        return None
    for number, sheets in enumerate(sheets_of(page)):
        if run == str(number):
            return _COMMENT.sub("", "\n".join(_text_of(sheet) for sheet in sheets))
    return None


def with_joined_sheets(page: str) -> str:
    """Return a page's HTML with a single link that replaces those to style sheets one after another."""
    number = itertools.count()
    link = '<link rel="stylesheet" href="/static/{}{}/{}.css">\n'
    return _RUN.sub(lambda _: link.format(JOINED, next(number), page), _text_of(page))


def _sheet_response(text: str, scope: Scope) -> Response:
    headers = {"Vary": "Accept-Encoding"}
    if not accepts_gzip(Headers(scope=scope)):
        return Response(text, media_type="text/css", headers=headers)
    return Response(_packed_text(text), media_type="text/css", headers=headers | {"Content-Encoding": "gzip"})


def _text_of(name: str) -> str:
    return (STATIC / name).read_text(encoding="utf-8")


@lru_cache(maxsize=16)
def _packed_text(text: str) -> bytes:
    return gzip.compress(text.encode(), _LEVEL, mtime=0)


@lru_cache(maxsize=_FILES)
def _packed_file(path: str, _mtime_ns: int, _size: int) -> bytes:
    """Return a file compressed; cached by its time and size, so that a changed file is read again."""
    return gzip.compress(Path(path).read_bytes(), _LEVEL, mtime=0)
