"""Datasets and recordings in an archive: what is sent and read in place, and what goes wrong."""

import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.support.scenes.dataset_scenes import written
from tests.support.scenes.recordings import record

from foveacam_bench.archive.storage_proxy import StorageProxy, refusal, storage_proxy
from foveacam_bench.archive.storage_server import (
    BUCKET,
    SMALLEST_PART_BYTES,
    StorageServer,
    storage_server,
)
from foveacam_hardware.contract import (
    Busy,
    Cancelled,
    DeviceFault,
    InvalidInput,
    NotConnected,
)
from foveacam_pipeline.capture.archiving import dataset_item, recording_item
from foveacam_pipeline.capture.dataset import Dataset, check_dataset
from foveacam_pipeline.capture.dataset.export import export_dataset
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.storage.archive import (
    ArchiveItem,
    ArchiveRecord,
    checked_url,
    fetch_item,
    find_item,
    list_archive,
    open_store,
    remove_large_files,
    upload_item,
)
from foveacam_pipeline.storage.archive.store import ENDPOINT

UTC = "2026-01-02T00:00:00+00:00"
PART_BYTES = SMALLEST_PART_BYTES


@pytest.fixture(scope="module")
def storage() -> Iterator[StorageServer]:
    """Storage in a process of its own."""
    with storage_server() as server:
        yield server


@pytest.fixture
def proxy(storage: StorageServer, monkeypatch: pytest.MonkeyPatch) -> Iterator[StorageProxy]:
    """The way to the storage, which can be cut."""
    for name, value in storage.environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr("s3fs.S3FileSystem.retries", 2)
    with storage_proxy(storage.port) as proxy:
        monkeypatch.setenv(ENDPOINT, f"http://127.0.0.1:{proxy.port}")
        yield proxy


@pytest.fixture(params=["s3", "file"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """An empty archive."""
    if request.param == "file":
        return f"file://{tmp_path}/archive"
    request.getfixturevalue("proxy")
    return f"s3://{BUCKET}/{tmp_path.name}"


def silent(done: int, total: int) -> None:
    """Hear of no progress."""


def item_of(folder: Path) -> ArchiveItem:
    dataset = Dataset.open(folder)
    return dataset_item(dataset, item_id=dataset.document.header.id)


def upload(url: str, folder: Path) -> ArchiveRecord:
    return upload_item(url, item_of(folder), utc=UTC, watch=silent)


def files_of(folder: Path) -> Mapping[str, bytes]:
    skipped = (".lock", "archived.json")
    found = (path for path in folder.rglob("*") if path.is_file() and path.name not in skipped)
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


def test_a_dataset_without_its_frames_is_read_from_the_archive(url: str, tmp_path: Path) -> None:
    folder = tmp_path / "small"
    images = [point.left for point in written(folder, 4)]

    record = upload(url, folder)
    freed = remove_large_files(item_of(folder), record)

    assert freed > 0
    assert not list((folder / "images").iterdir())
    opened = Dataset.open(folder)
    assert all(np.array_equal(point.left, image) for point, image in zip(opened, images, strict=True))
    assert check_dataset(folder) == []


def test_a_dataset_whose_frames_are_only_in_the_archive_is_exported_as_before(tmp_path: Path) -> None:
    folder, url = tmp_path / "small", f"file://{tmp_path}/archive"
    here = export_dataset(written(folder, 2), tmp_path / "here", to="ome-zarr")
    remove_large_files(item_of(folder), upload(url, folder))

    there = export_dataset(Dataset.open(folder), tmp_path / "there", to="ome-zarr")

    assert files_of(there) == files_of(here)


def test_another_folder_fetches_what_was_archived(url: str, tmp_path: Path) -> None:
    folder, copy = tmp_path / "small", tmp_path / "copy"
    written(folder, 3)
    upload(url, folder)

    (found,) = list_archive(url)
    assert find_item(url, "captures", found.manifest.id) == found
    fetch_item(found, {name: copy / name for name in found.manifest.files}, watch=silent)

    assert files_of(copy) == files_of(folder)
    assert found.manifest.name == "small"


def test_what_is_there_is_not_sent_again(tmp_path: Path, proxy: StorageProxy, storage: StorageServer) -> None:
    folder, url = tmp_path / "small", f"s3://{BUCKET}/again"
    written(folder, 3)
    upload(url, folder)
    before = _keys(storage, "again")

    upload(url, folder)

    assert {key: at for key, at in _keys(storage, "again").items() if "manifest" not in key} == {
        key: at for key, at in before.items() if "manifest" not in key
    }


def test_an_upload_that_is_cut_goes_on(tmp_path: Path, proxy: StorageProxy, storage: StorageServer) -> None:
    folder, url = tmp_path / "small", f"s3://{BUCKET}/cut"
    written(folder, 6)
    proxy.budget = 9_000

    with pytest.raises(NotConnected, match="the same request goes on where it stopped"):
        upload(url, folder)
    there = _keys(storage, "cut")
    assert not any(key.endswith("manifest.json") for key in there)

    proxy.restore()
    found = upload(url, folder)
    after = _keys(storage, "cut")
    assert {key: after[key] for key in there} == there
    copy = tmp_path / "copy"
    fetch_item(found, {name: copy / name for name in found.manifest.files}, watch=silent)
    assert files_of(copy) == files_of(folder)


def large_item(folder: Path, *, parts: int = 12) -> tuple[ArchiveItem, bytes]:
    """Return an item of one file that is sent in parts, and the file's content."""
    path = folder / "large.fcap"
    content = np.random.default_rng(parts).bytes(parts * PART_BYTES - 7)
    path.write_bytes(content)
    return recording_item(path, item_id="large", label="", created_utc=UTC, beside=(), about={}), content


def send_large(url: str, item: ArchiveItem, *, until: float = 1.0) -> ArchiveRecord:
    """Send an item in small parts; raise Cancelled when that share of it is there."""

    def watch(done: int, total: int) -> None:
        if until < 1.0 and done >= until * total:
            raise Cancelled("the job was cancelled")

    return upload_item(url, item, utc=UTC, watch=watch, part_bytes=PART_BYTES)


def test_a_large_file_that_is_cut_goes_on_after_its_last_part(tmp_path: Path, proxy: StorageProxy) -> None:
    (item, content), url = large_item(tmp_path), f"s3://{BUCKET}/large-cut"
    proxy.budget = len(content) // 2
    with pytest.raises(NotConnected, match="the same request goes on where it stopped"):
        send_large(url, item)
    proxy.restore()
    before = proxy.sent

    found = send_large(url, item)

    assert found.read("recording.fcap") == content
    assert proxy.sent - before < 0.5 * len(content) + 4 * PART_BYTES


def test_unfinished_parts_of_other_content_are_sent_again(url: str, tmp_path: Path) -> None:
    item, content = large_item(tmp_path)
    with pytest.raises(Cancelled):
        send_large(url, item, until=0.5)
    tamper_with_unfinished(url)

    assert send_large(url, item).read("recording.fcap") == content


def test_a_large_file_that_was_changed_after_a_cut_begins_anew(url: str, tmp_path: Path) -> None:
    item, _ = large_item(tmp_path)
    with pytest.raises(Cancelled):
        send_large(url, item, until=0.5)
    assert len(unfinished_of(url)) == 1

    item, content = large_item(tmp_path, parts=9)
    assert send_large(url, item).read("recording.fcap") == content
    assert unfinished_of(url) == []


def test_a_large_file_that_changes_while_it_is_sent_is_refused(url: str, tmp_path: Path) -> None:
    item, _ = large_item(tmp_path)
    path = item.files["recording.fcap"]

    def edit(done: int, total: int) -> None:
        path.write_bytes(bytes(path.stat().st_size))

    with pytest.raises(Busy, match=r"was changed meanwhile; archive it again"):
        upload_item(url, item, utc=UTC, watch=edit, part_bytes=PART_BYTES)
    assert list_archive(url) == []
    assert unfinished_of(url) == []


def test_a_file_that_changes_meanwhile_is_refused(tmp_path: Path) -> None:
    folder, url = tmp_path / "small", f"file://{tmp_path}/archive"
    written(folder, 1)

    def edit(done: int, total: int) -> None:
        (folder / "frames.csv").write_text("changed")

    with pytest.raises(Busy, match=r"was changed meanwhile; archive it again"):
        upload_item(url, item_of(folder), utc=UTC, watch=edit)
    assert list_archive(url) == []


def test_a_cancelled_upload_leaves_no_item(tmp_path: Path) -> None:
    folder, url = tmp_path / "small", f"file://{tmp_path}/archive"
    written(folder, 2)

    def cancel(done: int, total: int) -> None:
        raise Cancelled("the job was cancelled")

    with pytest.raises(Cancelled):
        upload_item(url, item_of(folder), utc=UTC, watch=cancel)
    assert list_archive(url) == []


def test_a_recording_is_read_in_place(url: str, tmp_path: Path) -> None:
    path = tmp_path / "looks.fcap"
    record(path, ticks=5)
    item = recording_item(path, item_id="rec-1", label="", created_utc=UTC, beside=(), about={})
    with Recording(path) as local:
        frames, local_bytes = list(local.frames()), local.size_bytes

    remove_large_files(item, upload_item(url, item, utc=UTC, watch=silent))

    assert not path.exists()
    with Recording(path) as archived:
        assert archived.size_bytes == local_bytes
        for frame in frames:
            found = archived.frame(frame.stream, frame.index)
            assert np.array_equal(found.image, frame.image)
            assert found.seq == frame.seq


def test_other_content_than_was_archived_is_refused(tmp_path: Path) -> None:
    folder, url = tmp_path / "small", f"file://{tmp_path}/archive"
    written(folder, 1)
    found = upload(url, folder)
    remove_large_files(item_of(folder), found)
    for path in (tmp_path / "archive").rglob("*.tif*"):
        content = bytearray(path.read_bytes())
        content[-1] ^= 1
        path.write_bytes(content)

    with pytest.raises(DeviceFault, match=r"not what was archived \(SHA-256\); archive it again"):
        _ = Dataset.open(folder)[0].left
    copy = tmp_path / "copy"
    with pytest.raises(DeviceFault, match="SHA-256"):
        fetch_item(found, {name: copy / name for name in found.manifest.files}, watch=silent)
    assert not list(copy.rglob("*.tif*"))


def test_frames_stay_where_the_archive_lost_them(tmp_path: Path) -> None:
    folder, url = tmp_path / "small", f"file://{tmp_path}/archive"
    written(folder, 2)
    found = upload(url, folder)
    shutil.rmtree(tmp_path / "archive")

    assert remove_large_files(item_of(folder), found) == 0
    assert len(list((folder / "images").iterdir())) == 6


def test_what_is_in_another_archive_alone_is_fetched_first(tmp_path: Path) -> None:
    folder, url = tmp_path / "small", f"file://{tmp_path}/archive"
    written(folder, 1)
    remove_large_files(item_of(folder), upload(url, folder))

    with pytest.raises(InvalidInput, match=r"are in file://.*/archive alone; fetch it first"):
        upload(f"file://{tmp_path}/other", folder)
    upload(url, folder)


@pytest.mark.parametrize(
    ("status", "code", "words"),
    [
        ("403 Forbidden", "AccessDenied", "refuses these credentials; let them list, read and write there"),
        ("301 Moved Permanently", "PermanentRedirect", "another region; set AWS_DEFAULT_REGION"),
        ("400 Bad Request", "AuthorizationHeaderMalformed", "another region; set AWS_DEFAULT_REGION"),
    ],
)
def test_what_the_storage_refuses_is_said_in_a_sentence(
    tmp_path: Path, proxy: StorageProxy, status: str, code: str, words: str
) -> None:
    folder = tmp_path / "small"
    written(folder, 1)
    proxy.refusal = refusal(status, code)

    with pytest.raises(InvalidInput, match=words):
        upload(f"s3://{BUCKET}/{code}", folder)


def test_a_bucket_that_is_not_there(tmp_path: Path, proxy: StorageProxy) -> None:
    folder = tmp_path / "small"
    written(folder, 1)
    with pytest.raises(InvalidInput, match="there is no such bucket; create it"):
        upload("s3://nothing-here/x", folder)
    with pytest.raises(InvalidInput, match="there is no such bucket; create it"):
        list_archive("s3://nothing-here")


def test_storage_that_goes_away_while_a_recording_is_read(tmp_path: Path, proxy: StorageProxy) -> None:
    path = tmp_path / "looks.fcap"
    record(path, ticks=200)
    item = recording_item(path, item_id="rec-2", label="", created_utc=UTC, beside=(), about={})
    remove_large_files(item, upload_item(f"s3://{BUCKET}/gone", item, utc=UTC, watch=silent))

    with Recording(path) as archived:
        proxy.drop()
        with pytest.raises(NotConnected, match="check the network"):
            archived.frame("left", 100)
        proxy.restore()
        assert archived.frame("left", 100).index == 100


def test_without_the_extra_the_install_command_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fsspec", None)
    with pytest.raises(InvalidInput, match=r"pip install 'foveacam-duo\[archive\]'"):
        open_store("s3://without-the-extra")


@pytest.mark.parametrize(
    "given", ["", "bucket/prefix", "https://host/bucket", "s3://", "s3://B?x", "file://x"]
)
def test_what_is_no_archive_is_refused(given: str) -> None:
    with pytest.raises(InvalidInput, match=r"give one such as s3://bucket/prefix"):
        checked_url(given)


def unfinished_of(url: str) -> list[tuple[str, str]]:
    """Return the objects below an archive of which parts alone are there: key or path, and upload id."""
    if url.startswith("file://"):
        return [(str(path), "") for path in Path(url.removeprefix("file://")).rglob("*.part")]
    prefix = url.removeprefix(f"s3://{BUCKET}/")
    with closing(boto_client()) as client:
        uploads = client.list_multipart_uploads(Bucket=BUCKET).get("Uploads", ())
    return [(each["Key"], each["UploadId"]) for each in uploads if each["Key"].startswith(prefix)]


def tamper_with_unfinished(url: str) -> None:
    """Put other content into the second part of the one unfinished object."""
    ((key, upload_id),) = unfinished_of(url)
    other = bytes(PART_BYTES)
    if url.startswith("file://"):
        with Path(key).open("r+b") as file:
            file.seek(PART_BYTES)
            file.write(other)
        return
    with closing(boto_client()) as client:
        client.upload_part(Bucket=BUCKET, Key=key, UploadId=upload_id, PartNumber=2, Body=other)


def boto_client() -> Any:  # noqa: ANN401 - boto ships no types
    return StorageServer(port=int(os.environ[ENDPOINT].rpartition(":")[2])).client()


def _keys(storage: StorageServer, prefix: str) -> dict[str, object]:
    client = storage.client()
    try:
        found = client.list_objects_v2(Bucket=BUCKET, Prefix=f"{prefix}/")
        return {entry["Key"]: entry["LastModified"] for entry in found.get("Contents", ())}
    finally:
        client.close()
