"""The authors' files: read as they are, refused by name when they are not, never written over."""

import json
import logging
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.exchange import (
    DeviceBundle,
    ExchangeRecord,
    extrinsic_record,
    intrinsic_record,
    read_bundle,
    read_record,
    write_bundle,
    write_record,
)
from foveacam_pipeline.calibrate.exchange.canonical import Json

from .exchange_rig import WIDE, Bench

WHEN = datetime(2026, 3, 1, 12, 30, 15, 250_000, tzinfo=UTC)
CREATED = "2026-02-01T10:00:00.000Z"
Document = dict[str, Any]  # Any: JSON that the tests damage on purpose


@pytest.fixture(scope="module")
def poses() -> ExchangeRecord:
    record = extrinsic_record(Bench().sweep(), Role.LEFT, wide=WIDE, label="bench")
    return replace(record, created_utc=CREATED, sources=("a" * 32,))


@pytest.fixture(scope="module")
def solve() -> ExchangeRecord:
    return intrinsic_record(WIDE, created_utc=CREATED)


@pytest.fixture
def exported(tmp_path: Path, poses: ExchangeRecord) -> Path:
    path = tmp_path / "poses.json"
    write_record(poses, path, exported=WHEN)
    return path


def damage(path: Path, change: Callable[[Document], None]) -> Path:
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document)
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def test_a_record_survives_there_and_back(exported: Path, poses: ExchangeRecord) -> None:
    again = read_record(exported)
    assert again.inner == poses.inner
    assert again.id == poses.id == again.stated_id
    assert (again.created_utc, again.label, again.role) == (CREATED, "bench", Role.LEFT)
    assert again.sources == ("a" * 32,)
    assert again.warning is None


def test_an_export_says_what_theirs_says(exported: Path) -> None:
    document = json.loads(exported.read_text(encoding="utf-8"))
    assert document["schema"] == "fovea-calibration-record@1"
    assert document["exported"] == "2026-03-01T12:30:15.250Z"
    assert set(document["record"]) == {"id", "inner", "created", "label", "sources", "role"}
    assert document["record"]["role"] == "L"


def test_a_record_of_their_store_is_read_with_its_cameras(tmp_path: Path, poses: ExchangeRecord) -> None:
    bindings = [{"cameraKey": "FLIR_BFS_1", "tripleHash": "t", "role": "L"}]
    outer = {"created": CREATED, "label": "old", "associations": bindings}
    path = tmp_path / "stored.json"
    path.write_text(json.dumps({"id": poses.id, "inner": poses.inner, "outer": outer}), encoding="utf-8")
    record = read_record(path)
    assert (record.id, record.role, record.label) == (poses.id, Role.LEFT, "old")
    record.check_camera("FLIR_BFS_1")
    with pytest.raises(InvalidInput, match="belongs to FLIR_BFS_1, this camera is FLIR_BFS_2"):
        record.check_camera("FLIR_BFS_2")


def test_what_we_do_not_know_is_kept_and_counts(exported: Path, poses: ExchangeRecord) -> None:
    damage(exported, lambda d: d["record"]["inner"]["dataset"][0].update(extra=1))
    record = read_record(exported)
    assert record.id != poses.id
    dataset = record.inner["dataset"]
    assert isinstance(dataset, list)
    assert dataset[0]["extra"] == 1


def test_another_id_than_the_content_has_is_told(exported: Path, caplog: pytest.LogCaptureFixture) -> None:
    damage(exported, lambda d: d["record"].update(id="0" * 32))
    with caplog.at_level(logging.WARNING):
        record = read_record(exported)
    assert record.warning is not None
    assert "the file says 00000000000000000000000000000000, its content is" in caplog.text


def _points(document: Document) -> list[Document]:
    points: list[Document] = document["record"]["inner"]["dataset"]
    return points


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda d: d.update(schema="fovea-device-config@1"), "fovea-device-config@1' was found"),
        (lambda d: d.update(schema="fovea-calibration-record@2"), "@2' was found"),
        (lambda d: d.update(record=None), "record: an object is needed"),
        (lambda d: d["record"].pop("inner"), "inner: an object is needed"),
        (lambda d: d["record"]["inner"].update(kind="wide"), "inner.kind: extrinsic or intrinsic"),
        (lambda d: d["record"].update(created="yesterday"), "date 'yesterday' is not like"),
        (lambda d: d["record"].update(created="2026-01-01T00:00:00"), "is not like"),
        (lambda d: d["record"].update(role="X"), "role"),
        (lambda d: _points(d)[3].pop("voltage"), r"dataset.3.voltage: Field required"),
        (lambda d: _points(d)[3]["voltage"].update(x="12"), r"dataset.3.voltage.x"),
        (lambda d: _points(d)[3]["img_points"].pop(), r"5 img_points and 6 obj_points"),
        (lambda d: _points(d)[3].update(img_points=[]), r"dataset.3.img_points"),
    ],
)
def test_a_damaged_record_is_refused_by_name(
    exported: Path, change: Callable[[Document], None], sentence: str
) -> None:
    with pytest.raises(InvalidInput, match=sentence) as refusal:
        read_record(damage(exported, change))
    assert str(exported) in str(refusal.value)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_truncated_file_is_refused(exported: Path, share: float) -> None:
    data = exported.read_bytes()
    exported.write_bytes(data[: int(share * len(data))])
    with pytest.raises(InvalidInput, match="damaged or cut off, export it again"):
        read_record(exported)


@pytest.mark.parametrize(
    "data", [b"\xff\xfe\x00", b'{"a": NaN}', b"[1, 2]", b"[" * 100_000, b"{}", b"PK\x03\x04"]
)
def test_a_foreign_file_is_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "foreign.json"
    path.write_bytes(data)
    with pytest.raises(InvalidInput, match=r"foreign\.json"):
        read_record(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"there is no file .*nowhere\.json"):
        read_record(tmp_path / "nowhere.json")


def test_nothing_is_written_over(exported: Path, poses: ExchangeRecord, solve: ExchangeRecord) -> None:
    before = exported.read_bytes()
    with pytest.raises(InvalidInput, match="exists already with another content, nothing was overwritten"):
        write_record(solve, exported, exported=WHEN)
    write_record(poses, exported, exported=WHEN)  # the same again does no harm
    assert exported.read_bytes() == before
    assert [path.name for path in exported.parent.iterdir()] == [exported.name]


def test_a_bundle_survives_there_and_back(
    tmp_path: Path, poses: ExchangeRecord, solve: ExchangeRecord
) -> None:
    config: dict[str, Json] = {
        "nickname": "Lab",
        "baseline_mm": 199.5,
        "drift_l": {"x": 0.001, "y": 0},
        "drift_r": None,
    }
    bundle = DeviceBundle(config=config, records=(solve, poses), triple="b" * 32)
    path = tmp_path / "rig.json"
    write_bundle(bundle, path, exported=WHEN)
    again = read_bundle(path)
    assert again.config == config
    assert again.triple == "b" * 32
    assert [record.id for record in again.records] == [solve.id, poses.id]
    assert again.settings.baseline_mm == 199.5
    assert json.loads(path.read_text(encoding="utf-8"))["sourceTripleHash"] == "b" * 32


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda d: d.update(schema="fovea-calibration-record@1"), "give the file of a device bundle"),
        (lambda d: d.pop("records"), "records: a list is needed"),
        (lambda d: d.pop("config"), "config: an object is needed"),
        (lambda d: d["config"].update(baseline_mm=-1), "config: baseline_mm"),
        (lambda d: d["records"][1]["inner"]["dataset"][0].pop("angle"), "records.1: .*dataset.0.angle"),
    ],
)
def test_one_bad_part_refuses_the_whole_bundle(
    tmp_path: Path,
    poses: ExchangeRecord,
    solve: ExchangeRecord,
    change: Callable[[Document], None],
    sentence: str,
) -> None:
    path = tmp_path / "rig.json"
    write_bundle(DeviceBundle(config={}, records=(solve, poses)), path, exported=WHEN)
    with pytest.raises(InvalidInput, match=sentence):
        read_bundle(damage(path, change))
