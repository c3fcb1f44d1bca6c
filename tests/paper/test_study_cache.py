"""Kept studies: found by all that they depend on, and never believed when damaged."""

from pathlib import Path

import pytest

from foveacam_hardware.contract import StorageFull
from foveacam_pipeline.study.report.cache import CachedStudy, DamagedFile, StudyCache, cache_key
from foveacam_pipeline.study.report.findings import PaperComparison, StudyResult

KEPT = CachedStudy(
    study=StudyResult(
        name="depth",
        section="4.1",
        title="Depth error",
        values={"ratio": 9.1, "label": "ΔZ"},
        rows=(PaperComparison(quantity="ratio", paper="about 9", ours="9.1"),),
        seeds={"noise": 3},
    ),
    took_s=1.5,
    made_utc="2026-01-02T03:04:05+00:00",
)


def test_what_is_kept_is_found_under_its_key_alone(tmp_path: Path) -> None:
    cache = StudyCache(tmp_path / "cache")
    assert cache.find("depth", "k") is None
    cache.store("k", KEPT)
    assert cache.find("depth", "k") == KEPT
    assert cache.find("depth", "other") is None
    assert [path.name for path in cache.folder.iterdir()] == ["depth-k.json"]


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "moved", "binary"])
def test_a_damaged_file_is_told_of_by_name(tmp_path: Path, damage: str) -> None:
    cache = StudyCache(tmp_path)
    path = cache.store("k", KEPT)
    content = path.read_bytes()
    damaged = {
        "cut": content[: len(content) // 2],
        "flipped": content.replace(b"9.1", b"9.9", 1),
        "empty": b"",
        "moved": content.replace(b'"key": "k"', b'"key": "j"'),
        "binary": b"\xff\xfe" + content,
    }[damage]
    assert damaged != content
    path.write_bytes(damaged)
    with pytest.raises(DamagedFile, match=r"depth-k\.json"):
        cache.find("depth", "k")
    cache.store("k", KEPT)
    assert cache.find("depth", "k") == KEPT


def test_the_key_follows_name_settings_and_content_of_the_files(tmp_path: Path) -> None:
    source, elsewhere = tmp_path / "a.py", tmp_path / "moved" / "a.py"
    elsewhere.parent.mkdir()
    source.write_text("one")
    elsewhere.write_text("one")
    key = cache_key("depth", {"quick": False, "seed": 1}, files=[source])
    assert cache_key("depth", {"seed": 1, "quick": False}, files=[elsewhere]) == key
    others = {
        cache_key("tokens", {"quick": False, "seed": 1}, files=[source]),
        cache_key("depth", {"quick": True, "seed": 1}, files=[source]),
        cache_key("depth", {"quick": False, "seed": 1}, files=[]),
    }
    source.write_text("two")
    others.add(cache_key("depth", {"quick": False, "seed": 1}, files=[source]))
    assert len(others | {key}) == 5


def test_a_folder_that_cannot_be_is_said_with_the_remedy(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StorageFull, match="the result of a study"):
        StudyCache(tmp_path / "file" / "cache").store("k", KEPT)
    assert (tmp_path / "file").read_text() == "in the way"
