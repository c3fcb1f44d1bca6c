import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import pytest
from sqlalchemy.exc import IntegrityError

from foveacam_hardware.contract import StorageFull
from foveacam_server.foundation import batched_writer
from foveacam_server.foundation.batched_writer import BatchedWriter
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store

PATIENCE_S = 10.0


class FillingDisk:
    """Takes batches while there is room, and refuses those that hold a negative number for good."""

    def __init__(self) -> None:
        self.room = threading.Event()
        self.room.set()
        self.batches: list[list[int]] = []
        self.calls: list[str] = []
        self.refused = threading.Semaphore(0)
        self.writer = BatchedWriter(
            "test-writer",
            save=self._save,
            on_fault=self.calls.append,
            on_recovered=lambda: self.calls.append("recovered"),
        )

    @property
    def written(self) -> list[int]:
        return [number for batch in self.batches for number in batch]

    def _save(self, batch: Sequence[int]) -> None:
        if not self.room.is_set():
            self.refused.release()
            raise StorageFull("no record was written", found="the disk is full")
        if min(batch) < 0:
            raise IntegrityError("negative", None, ValueError())
        self.batches.append(list(batch))


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[FillingDisk]:
    monkeypatch.setattr(batched_writer, "RETRY_S", 0.01)
    found = FillingDisk()
    yield found
    found.writer.close()


def add_all(disk: FillingDisk, numbers: Sequence[int]) -> None:
    for number in numbers:
        disk.writer.add(number)


def test_closing_writes_all_that_waits_in_its_order_and_in_batches(disk: FillingDisk) -> None:
    add_all(disk, range(3 * batched_writer.BATCH))
    disk.writer.close()
    assert disk.written == list(range(3 * batched_writer.BATCH))
    assert max(len(batch) for batch in disk.batches) <= batched_writer.BATCH
    assert disk.writer.unwritten == 0


def test_records_of_many_threads_are_all_written_each_thread_s_in_order(disk: FillingDisk) -> None:
    threads = [
        threading.Thread(target=add_all, args=(disk, range(1000 * n, 1000 * n + 500))) for n in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE_S)
    disk.writer.close()
    assert sorted(disk.written) == [1000 * n + i for n in range(4) for i in range(500)]
    for n in range(4):
        assert all(a < b for a, b in pairwise(number for number in disk.written if number // 1000 == n))


def test_flush_returns_when_what_was_added_is_written(disk: FillingDisk) -> None:
    add_all(disk, range(50))
    assert disk.writer.flush(timeout_s=PATIENCE_S)
    assert disk.written == list(range(50))


def test_what_a_full_disk_refused_is_written_once_there_is_room(disk: FillingDisk) -> None:
    disk.room.clear()
    add_all(disk, range(10))
    for _ in range(3):  # attempts
        assert disk.refused.acquire(timeout=PATIENCE_S)
    assert not disk.writer.flush(timeout_s=0.0)
    assert disk.writer.fault == "the disk is full"
    disk.room.set()
    assert disk.writer.flush(timeout_s=PATIENCE_S)
    disk.writer.close()
    assert disk.written == list(range(10))
    assert disk.calls == ["the disk is full", "recovered"]
    assert not disk.writer.fault and disk.writer.unwritten == 0


def test_closing_tries_once_more_what_a_full_disk_refused(
    disk: FillingDisk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batched_writer, "RETRY_S", 10.0 * PATIENCE_S)
    disk.room.clear()
    disk.writer.add(1)
    assert disk.refused.acquire(timeout=PATIENCE_S)
    disk.room.set()
    disk.writer.close()
    assert (disk.written, disk.writer.unwritten) == ([1], 0)


def test_closing_on_a_disk_that_takes_nothing_counts_what_is_lost(
    disk: FillingDisk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batched_writer, "MOST_WAITING", 10)
    disk.room.clear()
    add_all(disk, range(25))
    disk.writer.close()
    disk.writer.add(25)
    assert (disk.written, disk.writer.unwritten) == ([], 26)


def test_a_batch_that_the_database_refuses_for_good_holds_up_nothing(disk: FillingDisk) -> None:
    disk.writer.add(-1)
    assert disk.writer.flush(timeout_s=PATIENCE_S)
    disk.writer.add(2)
    disk.writer.close()
    assert (disk.written, disk.writer.unwritten) == ([2], 1)


EMITS_UNTIL_KILLED = """
import sys
from itertools import count
from pathlib import Path
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
log = EventLog(Store(Path(sys.argv[1])))
for number in count(1):
    log.emit("k", str(number))
    if number == 1000:
        log._writer.flush(timeout_s=60.0)
        print("written", flush=True)
"""


def test_a_program_that_is_killed_leaves_every_record_up_to_the_last_whole_batch(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", EMITS_UNTIL_KILLED, str(tmp_path)], stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "written\n"
        child.send_signal(signal.SIGKILL)
    with Store(tmp_path) as store:
        log = EventLog(store)
        kept = [(event.id, event.message) for event in log.after(0)]
        log.close()
    assert kept == [(number, str(number)) for number in range(1, len(kept) + 1)]
    assert len(kept) >= 1000
