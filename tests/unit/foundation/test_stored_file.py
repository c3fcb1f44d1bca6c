"""Files that are sent: whole, in parts, and gone."""

import asyncio
from pathlib import Path

import httpx
from fastapi import FastAPI

from foveacam_server.doors import error_handlers
from foveacam_server.foundation.http.stored_file import StoredFile


def answer_of(path: Path, headers: dict[str, str] | None = None) -> httpx.Response:
    app = FastAPI()
    error_handlers.install(app)
    app.add_api_route("/file", lambda: StoredFile(path), response_class=StoredFile)

    async def asking() -> httpx.Response:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://server") as client:
            return await client.get("/file", headers=headers)

    return asyncio.run(asking())


def test_a_file_is_sent_whole_and_in_parts(tmp_path: Path) -> None:
    path = tmp_path / "kept"
    path.write_bytes(b"0123456789")
    assert answer_of(path).content == b"0123456789"
    part = answer_of(path, {"Range": "bytes=2-4"})
    assert (part.status_code, part.content) == (206, b"234")


def test_a_file_that_was_removed_meanwhile_is_not_found(tmp_path: Path) -> None:
    gone = answer_of(tmp_path / "gone", {"Range": "bytes=0-1"})
    assert gone.status_code == 404
    assert "removed" in gone.json()["detail"]
