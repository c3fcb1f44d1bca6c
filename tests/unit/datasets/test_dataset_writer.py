"""A dataset's writer: what it acknowledged is there, whole, whatever happens next."""

import errno
import math
import os
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.dataset_scenes import header, noise_frame, noise_point, written

from foveacam_bench.capture.dataset_kills import KillPlan, kill_figures
from foveacam_hardware.contract import Busy, DeviceFault, FoveaError, InvalidInput, Role, StorageFull
from foveacam_pipeline.capture.dataset import (
    CapturedPoint,
    Dataset,
    DatasetState,
    DatasetWriter,
    ImageCodec,
    PlanPosition,
    Shot,
    WriterSettings,
    check_dataset,
    point_store,
)
from foveacam_pipeline.capture.dataset.journal import JOURNAL
from foveacam_pipeline.storage import disk


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "raster"


@pytest.mark.parametrize("codec", list(ImageCodec))
@pytest.mark.parametrize(("bits", "color"), [(8, False), (8, True), (10, False), (12, True)])
def test_frames_come_back_as_they_were_taken(folder: Path, codec: ImageCodec, bits: int, color: bool) -> None:
    frames = [noise_frame(role, 1, bits=bits, color=color) for role in Role]
    with DatasetWriter.create(folder, replace(header(1), codec=codec)) as writer:
        writer.add(
            CapturedPoint(place=PlanPosition(index=0), shots=tuple(Shot(frame=frame) for frame in frames))
        )
        writer.finish()
    point = Dataset.open(folder)[0]
    for frame in frames:
        read = point.frame(frame.role)
        np.testing.assert_array_equal(read.image, frame.image)
        assert replace(read, image=frame.image) == frame
    assert check_dataset(folder) == []


def test_brackets_and_stacks_are_told_apart(folder: Path) -> None:
    shots = [
        Shot(frame=noise_frame(role, 0, stack=10 * bracket + stack), bracket=bracket, stack=stack)
        for role in (Role.LEFT, Role.RIGHT)
        for bracket in range(2)
        for stack in range(3)
    ]
    with DatasetWriter.create(folder, header(1)) as writer:
        writer.add(CapturedPoint(place=PlanPosition(index=0), shots=tuple(shots)))
        writer.finish()
    point = Dataset.open(folder)[0]
    assert point.brackets == (0, 1)
    assert len(point.frames) == 12
    wanted = noise_frame(Role.RIGHT, 0, stack=12).image
    np.testing.assert_array_equal(point.frame(Role.RIGHT, bracket=1, stack=2).image, wanted)


def test_a_cancelled_dataset_is_valid_and_goes_on_at_the_next_point(folder: Path) -> None:
    with DatasetWriter.create(folder, header(3)) as writer:
        writer.add(noise_point(0))
        writer.close("cancelled by the operator")
    cancelled = Dataset.open(folder)
    assert (cancelled.document.state, cancelled.document.why) == (
        DatasetState.PARTIAL,
        "cancelled by the operator",
    )
    assert check_dataset(folder) == []
    with DatasetWriter.resume(folder) as writer:
        assert writer.next_point == 1
        for index in (1, 2):
            writer.add(noise_point(index))
        writer.finish()
    assert Dataset.open(folder).document.state is DatasetState.COMPLETE
    undisturbed = written(folder.parent / "other", 3)
    for name in ("frames.csv", JOURNAL):
        assert (folder / name).read_bytes() == (undisturbed.folder / name).read_bytes()


def test_an_error_on_the_way_ends_it_as_partial_and_says_why(folder: Path) -> None:
    with pytest.raises(DeviceFault), DatasetWriter.create(folder, header(2)) as writer:
        writer.add(noise_point(0))
        raise DeviceFault("the left camera is gone; plug it in")
    document = Dataset.open(folder).document
    assert (document.state, document.why) == (DatasetState.PARTIAL, "the left camera is gone; plug it in")


def test_a_point_that_was_passed_over_says_why(folder: Path) -> None:
    with DatasetWriter.create(folder, header(2)) as writer:
        writer.add(CapturedPoint(place=PlanPosition(index=0), skipped="out of reach of the right eye"))
        writer.add(noise_point(1))
        writer.finish()
    dataset = Dataset.open(folder)
    assert dataset.skipped == {0: "out of reach of the right eye"}
    assert [point.index for point in dataset] == [1]


@pytest.mark.parametrize("index", [0, 2, 3])
def test_points_out_of_turn_are_refused(folder: Path, index: int) -> None:
    with DatasetWriter.create(folder, header(3)) as writer:
        writer.add(noise_point(0))
        with pytest.raises(InvalidInput, match="point 1 of 3 is next"):
            writer.add(noise_point(index))


def test_two_frames_with_one_name_are_refused(folder: Path) -> None:
    shot = Shot(frame=noise_frame(Role.LEFT, 0))
    with DatasetWriter.create(folder, header(1)) as writer, pytest.raises(InvalidInput, match="number them"):
        writer.add(CapturedPoint(place=PlanPosition(index=0), shots=(shot, shot)))


def test_gazes_that_run_parallel_have_no_distance(folder: Path) -> None:
    point = noise_point(0)
    with DatasetWriter.create(folder, header(1)) as writer:
        writer.add(replace(point, place=replace(point.place, distance_m=math.inf)))
        writer.finish()
    assert Dataset.open(folder)[0].place.distance_m is None


def test_numbers_that_are_none_are_refused_before_the_disk_sees_them(folder: Path) -> None:
    point = noise_point(0)
    with DatasetWriter.create(folder, header(1)) as writer:
        with pytest.raises(InvalidInput, match="pass None"):
            writer.add(replace(point, place=replace(point.place, rail_m=math.nan)))
        assert writer.next_point == 0


def test_a_second_writer_is_kept_out(folder: Path) -> None:
    with DatasetWriter.create(folder, header(2)):
        with pytest.raises(Busy, match="being written already"):
            DatasetWriter.resume(folder)
        assert Dataset.open(folder).document.state is DatasetState.RUNNING
    with DatasetWriter.resume(folder) as writer:
        assert writer.next_point == 0


def test_a_folder_with_files_in_it_is_left_alone(folder: Path) -> None:
    folder.mkdir()
    (folder / "holiday.txt").write_text("mine")
    with pytest.raises(InvalidInput, match="holds files already"):
        DatasetWriter.create(folder, header(1))
    assert [path.name for path in folder.iterdir()] == ["holiday.txt"]


def broken_disk(first: str, number: int) -> Callable[..., None]:
    """Return what writes files until the name of one begins with `first`; none from there on."""

    def fail(path: Path, content: memoryview, *, mode: int | None = None) -> None:
        if path.name >= first:
            disk.part_path(path).write_bytes(bytes(content[:10]))
            raise OSError(number, "no")
        disk.write_part(path, content, mode=mode)

    return fail


@pytest.mark.parametrize(
    ("number", "kind", "words"),
    [
        (errno.ENOSPC, StorageFull, "disk is full"),
        (errno.EDQUOT, StorageFull, "quota of the disk is used up"),
        (errno.EROFS, StorageFull, "cannot be written"),
        (errno.EIO, DeviceFault, "disk failed"),
    ],
)
def test_an_error_of_the_disk_comes_back_and_costs_no_earlier_point(
    folder: Path, monkeypatch: pytest.MonkeyPatch, number: int, kind: type[FoveaError], words: str
) -> None:
    monkeypatch.setattr(point_store, "write_part", broken_disk("00001-left", number))
    with (
        pytest.raises(kind, match=f"point 1.*{words}"),
        DatasetWriter.create(folder, header(9)) as writer,
    ):
        for index in range(9):
            writer.add(noise_point(index))
        writer.finish()
    assert check_dataset(folder) == []
    monkeypatch.undo()
    with DatasetWriter.resume(folder) as writer:
        assert writer.next_point == 1


def test_a_journal_that_cannot_grow_leaves_no_half_line(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int, content: bytes, at: int) -> int:
        if at == 0:
            return write(descriptor, content, at)
        write(descriptor, content[:20], at)
        raise OSError(errno.ENOSPC, "no")

    write = os.pwrite
    monkeypatch.setattr("foveacam_pipeline.capture.dataset.journal.os.pwrite", full)
    with DatasetWriter.create(folder, header(2)) as writer:
        writer.add(noise_point(0))
        writer.flush()
        writer.add(noise_point(1))
        with pytest.raises(StorageFull, match="full"):
            writer.flush()
    assert (folder / JOURNAL).read_bytes().count(b"\n") == 1
    assert (folder / JOURNAL).read_bytes().endswith(b"\n")
    assert check_dataset(folder) == []


def test_a_writer_that_is_faster_than_the_disk_waits_and_says_how_long(folder: Path) -> None:
    blocked, go = threading.Event(), threading.Event()

    def slow(index: int) -> None:
        blocked.set()
        assert go.wait(timeout=30.0)

    with DatasetWriter.create(folder, header(4), WriterSettings(depth=1, on_acknowledged=slow)) as writer:
        writer.add(noise_point(0))
        assert blocked.wait(timeout=30.0)
        writer.add(noise_point(1))
        adding = threading.Thread(target=writer.add, args=(noise_point(2),))
        adding.start()
        assert writer.progress.queued == 2  # one on its way to the disk, one waits: the third is not taken
        go.set()
        adding.join()
        writer.flush()
        assert writer.progress.waited_s > 0.0
        assert (writer.progress.acknowledged, writer.progress.queued) == (3, 0)


def test_a_writer_that_waits_hears_of_the_error_at_once(folder: Path) -> None:
    blocked, go = threading.Event(), threading.Event()
    heard: list[FoveaError] = []

    def failing(index: int) -> None:
        blocked.set()
        assert go.wait(timeout=30.0)
        raise DeviceFault("the disk failed")

    def add() -> None:
        try:
            writer.add(noise_point(2))
        except FoveaError as error:
            heard.append(error)

    with DatasetWriter.create(folder, header(4), WriterSettings(depth=1, on_acknowledged=failing)) as writer:
        writer.add(noise_point(0))
        assert blocked.wait(timeout=30.0)
        writer.add(noise_point(1))
        adding = threading.Thread(target=add)
        adding.start()
        go.set()
        adding.join(timeout=30.0)
        assert [str(error) for error in heard] == ["the disk failed"]


def interrupted(folder: Path, points: int, planned: int) -> Path:
    """Leave a dataset as a program that was killed leaves it."""
    written(folder, points)
    document = folder / "dataset.json"
    text = (
        document.read_text()
        .replace('"complete"', '"running"')
        .replace(f'"points": {points}', f'"points": {planned}')
    )
    document.write_text(text)
    (folder / "frames.csv").unlink()
    return folder


def test_resuming_drops_a_torn_line_and_what_nobody_acknowledged(folder: Path) -> None:
    interrupted(folder, 2, 3)
    images = folder / "images"
    journal = (folder / JOURNAL).read_bytes()
    (folder / JOURNAL).write_bytes(journal + journal[:100])
    (images / "00002-left-b0-s0.tiff").write_bytes(b"half")
    (images / ".00002-wide-b0-s0.tiff.part").write_bytes(b"half")
    (images / "notes.txt").write_text("the operator's own")
    assert len(Dataset.open(folder)) == 2
    with DatasetWriter.resume(folder) as writer:
        assert writer.next_point == 2
        assert len(list(images.iterdir())) == 7
        writer.add(noise_point(2))
        writer.finish()
    (images / "notes.txt").unlink()
    assert check_dataset(folder) == []
    assert (folder / "frames.csv").read_bytes() == (
        written(folder.parent / "b", 3).folder / "frames.csv"
    ).read_bytes()


def test_a_journal_damaged_before_its_end_is_not_overwritten(folder: Path) -> None:
    interrupted(folder, 3, 4)
    journal = bytearray((folder / JOURNAL).read_bytes())
    journal[60] ^= 1
    (folder / JOURNAL).write_bytes(journal)
    with pytest.raises(InvalidInput, match="line 1 is damaged"):
        DatasetWriter.resume(folder)
    assert (folder / JOURNAL).read_bytes() == journal
    assert len(list((folder / "images").iterdir())) == 9


def test_an_acknowledged_image_that_is_gone_is_told_before_anything_is_taken(folder: Path) -> None:
    interrupted(folder, 2, 4)
    (folder / "images" / "00001-left-b0-s0.tiff").unlink()
    with pytest.raises(InvalidInput, match="point 1, is gone"):
        DatasetWriter.resume(folder)


def test_a_complete_dataset_is_not_resumed(folder: Path) -> None:
    written(folder, 1)
    with pytest.raises(InvalidInput, match="is complete"):
        DatasetWriter.resume(folder)


def test_kills_at_random_moments_lose_nothing_that_was_acknowledged(tmp_path: Path) -> None:
    figures = kill_figures(tmp_path, KillPlan(kills=5, seed=11))
    assert figures["kills"] >= 5
    bad = {name: figures[name] for name in ("lost", "damaged", "duplicates", "unequal", "findings")}
    assert not any(bad.values()), bad


def test_a_dataset_that_a_full_disk_does_not_let_begin_leaves_no_folder(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(disk, "write_part", broken_disk("dataset", errno.ENOSPC))
    with pytest.raises(StorageFull, match=f"dataset {folder.name} in .*: the disk is full"):
        DatasetWriter.create(folder, header(1))
    assert not folder.exists()
