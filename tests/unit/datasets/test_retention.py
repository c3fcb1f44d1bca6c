"""Rules of retention: what is too old or too much, what is kept always, and that only the preview goes."""

import json
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from tests.support.scenes.dataset_scenes import written
from tests.support.scenes.fixations import fixation
from tests.unit.depth.test_clouds import shape
from typer.testing import CliRunner

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_pipeline.capture.dataset import change_labels
from foveacam_server.cli import app
from foveacam_server.foundation.errors import EditedMeanwhile
from foveacam_server.foundation.job_table import Job, JobTable
from foveacam_server.foundation.store import Store
from foveacam_server.resources.capturing.retention.rules import RetentionSource, read_rules
from foveacam_server.resources.capturing.retention.service import RetentionService
from foveacam_server.resources.looking.clouds.collection import CloudCollection
from foveacam_server.resources.looking.fixations.table import FixatedTarget, FixationTable, TargetTable


@dataclass
class Kept:
    """A stored thing."""

    id: str
    age_days: float
    label: str = ""
    size_bytes: int = 400_000_000

    @property
    def name(self) -> str:
        return self.id

    @property
    def created_utc(self) -> str:
        return (datetime.now(UTC) - timedelta(days=self.age_days)).isoformat()


class Shelf:
    """Stored things in memory."""

    def __init__(self, *kept: Kept, in_use: tuple[str, ...] = ()) -> None:
        self.kept = list(kept)
        self.source = RetentionSource(
            every=lambda: self.kept, in_use=lambda kept_id: kept_id in in_use, remove=self._remove
        )

    def _remove(self, kept_id: str) -> None:
        self.kept = [kept for kept in self.kept if kept.id != kept_id]

    @property
    def ids(self) -> list[str]:
        return [kept.id for kept in self.kept]


def service_of(folder: Path, rules: str, shelf: Shelf) -> RetentionService:
    (folder / "retention.toml").write_text(rules)
    return RetentionService(folder, {"recordings": shelf.source})


def test_what_is_older_than_the_rule_is_due(tmp_path: Path) -> None:
    shelf = Shelf(Kept("new", 1.0), Kept("old", 31.0))
    found = service_of(tmp_path, "[retention.recordings]\nkeep_days = 30\n", shelf).preview()
    assert [(item.id, item.why) for item in found.items] == [("old", "older than 30 days")]
    assert found.size_bytes == 400_000_000


def test_the_newest_up_to_the_size_are_kept(tmp_path: Path) -> None:
    shelf = Shelf(Kept("c", 3.0), Kept("a", 1.0), Kept("b", 2.0))
    found = service_of(tmp_path, "[retention.recordings]\nkeep_gb = 1\n", shelf).preview()
    assert [(item.id, item.why) for item in found.items] == [("c", "beyond the newest 1 GB")]


def test_labelled_ones_and_those_in_use_are_kept_always(tmp_path: Path) -> None:
    shelf = Shelf(Kept("named", 99.0, label="for the paper"), Kept("open", 99.0), in_use=("open",))
    rules = "[retention.recordings]\nkeep_days = 30\nkeep_gb = 0.1\n"
    assert service_of(tmp_path, rules, shelf).preview().items == []


def test_exactly_the_preview_is_moved(tmp_path: Path) -> None:
    shelf = Shelf(Kept("new", 1.0), Kept("old", 31.0))
    service = service_of(tmp_path, "[retention.recordings]\nkeep_days = 30\n", shelf)
    digest = service.preview().digest
    shelf.kept.append(Kept("another", 40.0))

    with pytest.raises(EditedMeanwhile, match="nothing was removed; look again"):
        service.apply(digest)
    assert shelf.ids == ["new", "old", "another"]
    service.apply(service.preview().digest)
    assert shelf.ids == ["new"]


@pytest.mark.parametrize(("automatic", "left"), [("true", ["new"]), ("false", ["new", "old"])])
def test_nothing_goes_by_itself_unless_it_is_switched_on(
    tmp_path: Path, automatic: str, left: list[str]
) -> None:
    shelf = Shelf(Kept("new", 1.0), Kept("old", 31.0))
    rules = f"[retention]\nautomatic = {automatic}\n[retention.recordings]\nkeep_days = 30\n"
    service_of(tmp_path, rules, shelf).apply_automatic()
    assert shelf.ids == left


@pytest.mark.parametrize("wrong", ["[retention", "[other]\n", "[retention]\nkeep = 3\n"])
def test_a_wrong_file_is_refused(tmp_path: Path, wrong: str) -> None:
    (tmp_path / "retention.toml").write_text(wrong)
    with pytest.raises(InvalidInput, match=r"retention\.toml"):
        read_rules(tmp_path)


def test_the_commands_show_and_move(tmp_path: Path) -> None:
    for name in ("kept", "gone"):
        written(tmp_path / "captures" / name, 1)
    change_labels(tmp_path / "captures" / "kept", label="for the paper")
    change_labels(tmp_path / "captures" / "gone", label="")
    (tmp_path / "retention.toml").write_text("[retention.captures]\nkeep_days = 0.001\n")
    options = ["--data", str(tmp_path), "--json"]

    shown = json.loads(CliRunner().invoke(app, ["retention", "show", *options]).output)
    assert [item["name"] for item in shown["items"]] == ["gone"]
    with Store(tmp_path):
        refused = CliRunner().invoke(app, ["retention", "apply", *options])
        assert isinstance(refused.exception, Busy)
    CliRunner().invoke(app, ["retention", "apply", *options])
    assert (tmp_path / "captures" / "kept").is_dir()
    assert not (tmp_path / "captures" / "gone").exists()


@pytest.fixture
def looks(tmp_path: Path) -> Path:
    """A folder with four fixations and two clouds: numbered, labelled, named by a job, and the newest."""
    (tmp_path / "retention.toml").write_text(
        "[retention.clouds]\nkeep_gb = 1e-9\n[retention.fixations]\nkeep_days = 30\n"
    )
    with Store(tmp_path) as store:
        fixations, targets, clouds = FixationTable(store), TargetTable(store), CloudCollection(store)
        for name, label in (("old", "Target 1"), ("labelled", "the door"), ("used", "Target 3")):
            found = fixation(name, target_id=f"tgt-{name}")
            fixations.add(found)
            targets.put(
                FixatedTarget(id=f"tgt-{name}", label=label, created_utc=found.created_utc, fixation=found)
            )
        fixations.add(fixation("newest"))
        for name in ("old", "newest"):
            clouds.put(shape(fixation_id=f"fix-{name}"))
        JobTable(store).add(Job(id="job-9", kind="fixation", request={"corrects": "fix-used"}))
    return tmp_path


def test_clouds_then_their_fixations_are_deleted_for_good(looks: Path) -> None:
    options = ["--data", str(looks), "--json"]

    def due(command: str) -> list[tuple[str, str, bool]]:
        run = CliRunner().invoke(app, ["retention", command, *options])
        assert run.exit_code == 0, run.exception
        found = json.loads(run.output)
        return [(item["kind"], item["name"], item["for_good"]) for item in found["items"]]

    with Store(looks):
        assert due("show") == [("clouds", "Target 1", True)]  # beside a server, too
    assert due("apply") == [("clouds", "Target 1", True)]
    assert len(list((looks / "clouds").iterdir())) == 1
    assert due("apply") == [("fixations", "Target 1", True)]
    with Store(looks) as store:
        assert [each.id for each in FixationTable(store).newest(9)] == [
            "fix-newest",
            "fix-used",
            "fix-labelled",
        ]
        assert [each.label for each in TargetTable(store).every()] == ["the door", "Target 3"]
