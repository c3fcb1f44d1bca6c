"""Captures that the rules of retention leave alone because somebody writes them or is about to."""

import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from tests.support.scenes.dataset_scenes import header, noise_point
from typer.testing import CliRunner

from foveacam_pipeline.capture.dataset import DatasetWriter
from foveacam_server.assembly.collection_services import open_retention
from foveacam_server.cli import app
from foveacam_server.datasets.collection import DatasetCollection
from foveacam_server.datasets.derived_products import DerivedProductTools
from foveacam_server.resources.capturing.captures.schema import CaptureDocument
from foveacam_server.resources.capturing.exports.service import ExportService
from foveacam_server.resources.capturing.retention.service import RetentionService


@contextmanager
def being_written(data: Path) -> Iterator[None]:
    """An unlabelled capture that is too old by the rules, while a program writes it."""
    (data / "retention.toml").write_text("[retention.captures]\nkeep_days = 0.001\n")
    with DatasetWriter.create(data / "captures" / "running", replace(header(2), label="")) as writer:
        writer.add(noise_point(0))
        yield


class Captures:
    """The captures of a server, of which some are queued."""

    def __init__(self, folder: Path) -> None:
        self.collection = DatasetCollection(folder)
        self.queued: set[str] = set()

    def search(self) -> list[CaptureDocument]:
        return [CaptureDocument.of(stored) for stored in self.collection.every()]

    def is_running(self, capture_id: str) -> bool:
        return capture_id in self.queued

    def remove(self, capture_id: str) -> None:
        self.collection.remove(capture_id)


@pytest.fixture
def captures(tmp_path: Path) -> Captures:
    return Captures(tmp_path / "captures")


@pytest.fixture
def retention(tmp_path: Path, captures: Captures) -> Iterator[RetentionService]:
    """The rules as a server applies them to its captures; it has nothing else."""
    products = SimpleNamespace(check_idle=lambda *_: None)
    others = SimpleNamespace(search=list, is_in_use=None, remove=None)
    collections = SimpleNamespace(
        captures=captures,
        recordings=others,
        stills=others,
        mosaics=products,
        references=products,
        exports=ExportService(
            DerivedProductTools(
                captures=captures,
                jobs=cast(Any, SimpleNamespace(handle=lambda *_, **__: None)),
                events=cast(Any, None),
                clock=cast(Any, None),
            )
        ),
    )
    with ExitStack() as stack:
        foundation = SimpleNamespace(settings=SimpleNamespace(data=tmp_path), stack=stack)
        yield open_retention(
            cast(Any, SimpleNamespace(foundation=foundation)), cast(Any, collections), looks={}
        )


def due(service: RetentionService) -> list[str]:
    return [item.name for item in service.preview().items]


def test_a_server_keeps_a_capture_that_another_program_writes(
    tmp_path: Path, retention: RetentionService
) -> None:
    with being_written(tmp_path):
        assert due(retention) == []
    assert due(retention) == ["running"]


def test_a_server_keeps_a_capture_whose_job_is_queued(
    tmp_path: Path, captures: Captures, retention: RetentionService
) -> None:
    with being_written(tmp_path):
        pass
    captures.queued.add("test")
    assert due(retention) == []
    captures.queued.clear()
    assert due(retention) == ["running"]


def test_the_commands_keep_a_capture_that_is_being_written(tmp_path: Path) -> None:
    def shown() -> list[str]:
        run = CliRunner().invoke(app, ["retention", "show", "--data", str(tmp_path), "--json"])
        return [item["name"] for item in json.loads(run.output)["items"]]

    with being_written(tmp_path):
        assert shown() == []
    assert shown() == ["running"]
