"""The authors' bundles: read as they are, refused by name when they are not."""

import json
import logging
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import pytest
from tests.support.scenes.exchange_rig import WIDE, Bench

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.exchange import (
    DeviceBundle,
    ExchangeRecord,
    bundle_document,
    bundle_from,
    extrinsic_record,
    intrinsic_record,
)
from foveacam_pipeline.calibrate.exchange.canonical import Json

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
def exported(poses: ExchangeRecord) -> Document:
    return document_of(DeviceBundle(config={}, records=(poses,)))


def document_of(bundle: DeviceBundle) -> Document:
    """Return the document as it is after a file."""
    read: Document = json.loads(json.dumps(bundle_document(bundle, exported=WHEN)))
    return read


def read_record(document: Document) -> ExchangeRecord:
    (record,) = bundle_from(document, what="rig.json").records
    return record


def test_a_record_survives_there_and_back(exported: Document, poses: ExchangeRecord) -> None:
    again = read_record(exported)
    assert again.inner == poses.inner
    assert again.id == poses.id == again.stated_id
    assert (again.created_utc, again.label, again.role) == (CREATED, "bench", Role.LEFT)
    assert again.sources == ("a" * 32,)
    assert again.warning is None


def test_an_export_says_what_theirs_says(exported: Document) -> None:
    assert exported["schema"] == "fovea-device-config@1"
    assert exported["exported"] == "2026-03-01T12:30:15.250Z"
    assert set(exported["records"][0]) == {"id", "inner", "created", "label", "sources", "role"}
    assert exported["records"][0]["role"] == "L"


def test_what_we_do_not_know_is_kept_and_counts(exported: Document, poses: ExchangeRecord) -> None:
    exported["records"][0]["inner"]["dataset"][0].update(extra=1)
    record = read_record(exported)
    assert record.id != poses.id
    dataset = record.inner["dataset"]
    assert isinstance(dataset, list)
    assert dataset[0]["extra"] == 1


def test_another_id_than_the_content_has_is_told(
    exported: Document, caplog: pytest.LogCaptureFixture
) -> None:
    exported["records"][0].update(id="0" * 32)
    with caplog.at_level(logging.WARNING):
        record = read_record(exported)
    assert record.warning is not None
    assert "the file says 00000000000000000000000000000000, its content is" in caplog.text


def _points(document: Document) -> list[Document]:
    points: list[Document] = document["records"][0]["inner"]["dataset"]
    return points


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda d: d.update(schema="fovea-device-config@2"), "@2' was found"),
        (lambda d: d.update(records=[None]), "records.0: an object is needed"),
        (lambda d: d["records"][0].pop("inner"), "inner: an object is needed"),
        (lambda d: d["records"][0]["inner"].update(kind="wide"), "inner.kind: extrinsic or intrinsic"),
        (lambda d: d["records"][0].update(created="yesterday"), "date 'yesterday' is not like"),
        (lambda d: d["records"][0].update(created="2026-01-01T00:00:00"), "is not like"),
        (lambda d: d["records"][0].update(role="X"), "role"),
        (lambda d: _points(d)[3].pop("voltage"), r"dataset.3.voltage: Field required"),
        (lambda d: _points(d)[3]["voltage"].update(x="12"), r"dataset.3.voltage.x"),
        (lambda d: _points(d)[3]["img_points"].pop(), r"5 img_points and 6 obj_points"),
        (lambda d: _points(d)[3].update(img_points=[]), r"dataset.3.img_points"),
    ],
)
def test_a_damaged_record_is_refused_by_name(
    exported: Document, change: Callable[[Document], None], sentence: str
) -> None:
    change(exported)
    with pytest.raises(InvalidInput, match=sentence) as refusal:
        read_record(exported)
    assert "rig.json" in str(refusal.value)


def test_a_bundle_survives_there_and_back(poses: ExchangeRecord, solve: ExchangeRecord) -> None:
    config: dict[str, Json] = {
        "nickname": "Lab",
        "baseline_mm": 199.5,
        "drift_l": {"x": 0.001, "y": 0},
        "drift_r": None,
    }
    bundle = DeviceBundle(config=config, records=(solve, poses))
    again = bundle_from(document_of(bundle), what="rig.json")
    assert again.config == config
    assert [record.id for record in again.records] == [solve.id, poses.id]
    assert again.settings.baseline_mm == 199.5


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
    poses: ExchangeRecord,
    solve: ExchangeRecord,
    change: Callable[[Document], None],
    sentence: str,
) -> None:
    document = document_of(DeviceBundle(config={}, records=(solve, poses)))
    change(document)
    with pytest.raises(InvalidInput, match=sentence):
        bundle_from(document, what="rig.json")
