"""The data folder of the version before this one is used as it is: restored from its backup, then served."""

import hashlib
import lzma
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_pipeline.workers.progress import SILENT
from foveacam_server.foundation.backup.archive import BackupManifest
from foveacam_server.foundation.backup.restore import restore
from foveacam_server.foundation.store import DATABASE
from tests.support.servers.running_server import API, CENTRE, SELDOM_HZ, Running, running

BACKUP = Path(__file__).parents[2] / "data" / "backup-0.1-before-people.tar.xz"
"""Of a simulated rig: a fixation with its cloud, a measurement, camera settings, a preset, a layout."""


@pytest.fixture(scope="module")
def restored(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, BackupManifest]:
    folder = tmp_path_factory.mktemp("upgrade")
    archive = folder / "before.tar"
    with lzma.open(BACKUP) as packed, archive.open("wb") as unpacked:
        shutil.copyfileobj(packed, unpacked)
    return folder / "data", restore(archive, folder / "data", watch=SILENT)


@pytest.fixture(scope="module")
def upgraded(restored: tuple[Path, BackupManifest]) -> Iterator[Running]:
    with running(restored[0], live_hz=SELDOM_HZ) as server:
        yield server


def test_what_the_version_before_stored_is_listed(upgraded: Running) -> None:
    (fixation,) = upgraded.get("/fixations").json()
    assert (fixation["state"], round(fixation["distance_m"])) == ("verged", 8)
    (target,) = upgraded.get("/targets").json()
    assert target["fixation_id"] == fixation["id"]
    (measurement,) = upgraded.get("/measurements").json()
    assert (measurement["label"], measurement["fixation_ids"]) == ("corner", [fixation["id"]])
    (cloud,) = upgraded.get("/clouds").json()
    assert upgraded.get(f"/clouds/{cloud['id']}.ply").content.startswith(b"ply")
    assert [preset["name"] for preset in upgraded.get("/cameras/presets").json()] == ["evening"]
    assert [layout["name"] for layout in upgraded.get("/views/layouts").json()] == ["mine"]
    assert upgraded.get("/cameras/left").json()["settings"]["exposure_ms"] == pytest.approx(7.0, abs=0.1)
    assert [job["state"] for job in upgraded.get("/jobs").json()] == ["succeeded"]
    assert any(event["kind"] == "fixation.done" for event in upgraded.get("/events/recent").json())


def test_no_file_was_changed_and_the_database_was_copied_first(
    restored: tuple[Path, BackupManifest], upgraded: Running
) -> None:
    folder, manifest = restored
    for file in manifest.files:
        if file.path != DATABASE:
            content = (folder / file.path).read_bytes()
            assert hashlib.sha256(content).hexdigest() == file.sha256, file.path
    assert [copy.name for copy in folder.glob("*.before-*")] == [f"{DATABASE}.before-0004"]


def test_it_goes_on_and_stays_open_to_the_person_who_used_it(upgraded: Running) -> None:
    assert upgraded.get("/session").json()["mode"] == "open"
    linked = {"exposure_ms": 8.0, "linked": True}  # one pulse exposes both eyes
    assert upgraded.http.patch(f"{API}/cameras/left", json=linked).status_code == 200
    assert upgraded.fixate({**CENTRE, "depth": False})["state"] in ("verged", "no_texture", "lost")
    assert len(upgraded.get("/fixations").json()) == 2
    upgraded.services.accounts.audit.flush()
    newest = upgraded.get("/audit").json()["entries"][0]
    assert (newest["path"], newest["who"]) == ("/api/v1/fixations", "this machine")
