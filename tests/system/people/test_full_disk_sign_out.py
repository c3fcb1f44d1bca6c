"""Signing out while the disk of the server takes nothing: it holds, also after a restart."""

from pathlib import Path

import httpx
import pytest

from foveacam_bench.small_disk import small_disk
from tests.system.conftest import API, PATIENCE_S, missing_rig, running

PASSWORD = "correct horse battery"  # noqa: S105  # a password of this test alone
DISK_BYTES = 16_000_000


def browser(port: int, *, cookies: httpx.Cookies | None = None) -> httpx.Client:
    base = f"http://127.0.0.1:{port}"
    return httpx.Client(base_url=base, cookies=cookies, timeout=PATIENCE_S, trust_env=False)


def test_a_sign_out_on_a_full_disk_holds_over_a_restart(tmp_path: Path) -> None:
    folder = tmp_path / "disk"
    folder.mkdir()
    with small_disk(folder, size_bytes=DISK_BYTES) as disk:
        if disk is None:
            pytest.skip("no file system may be mounted here")
        rig = missing_rig(tmp_path)
        with running(folder / "data", rig=rig) as server, browser(server.port) as ada:
            body = {"name": "ada", "role": "admin", "password": PASSWORD}
            assert ada.post(f"{API}/users", json=body).status_code == 201
            cookies = httpx.Cookies(ada.cookies)
            disk.fill()
            assert (
                server.http.post(f"{API}/session", json={"name": "ada", "password": PASSWORD}).status_code
                == 507
            )
            assert ada.delete(f"{API}/session").status_code == 204
            with browser(server.port, cookies=cookies) as thief:
                assert thief.get(f"{API}/rig").status_code == 401
            disk.free()
        with running(folder / "data", rig=rig) as server, browser(server.port, cookies=cookies) as thief:
            assert thief.get(f"{API}/rig").status_code == 401
