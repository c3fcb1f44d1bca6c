"""The count of the processor time of the tests, with and without workers."""

import json
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from tests.support.cpu_seconds import COLLECTION, CpuSeconds, used_s

FILE = "tests/unit/some/test_file.py"


def session_of(**config: object) -> pytest.Session:
    return SimpleNamespace(config=SimpleNamespace(**config))  # type: ignore[return-value]  # what is read of one


def item() -> pytest.Item:
    root = Path("/project")
    return SimpleNamespace(path=root / FILE, config=SimpleNamespace(rootpath=root))  # type: ignore[return-value]  # likewise


def run_one(counted: CpuSeconds, *, busy_s: float) -> None:
    protocol = counted.pytest_runtest_protocol(item())
    next(protocol)
    end_s = used_s() + busy_s
    while used_s() < end_s:
        pass
    with pytest.raises(StopIteration):
        protocol.send(None)


def test_what_workers_used_is_added_and_written_most_first(tmp_path: Path) -> None:
    written = CpuSeconds(tmp_path / "cpu.json")
    for _ in range(2):
        worker, output = CpuSeconds(tmp_path / "none.json"), dict[str, object]()
        worker.pytest_collection_finish()
        run_one(worker, busy_s=0.05)
        worker.pytest_sessionfinish(session_of(workeroutput=output))
        written.pytest_testnodedown(SimpleNamespace(workeroutput=output))
    written.pytest_sessionfinish(session_of())
    found = json.loads((tmp_path / "cpu.json").read_text())
    assert list(found) == [COLLECTION, FILE]
    assert 0.08 <= found[FILE] < 0.4
    assert not (tmp_path / "none.json").exists()


def test_what_a_process_used_that_a_test_started_counts_and_waiting_does_not(tmp_path: Path) -> None:
    counted = CpuSeconds(tmp_path / "cpu.json")
    protocol = counted.pytest_runtest_protocol(item())
    next(protocol)
    busy = "import time\nwhile time.process_time() < 0.2: pass"
    subprocess.run([sys.executable, "-S", "-c", busy], check=True)
    time.sleep(0.5)
    with pytest.raises(StopIteration):
        protocol.send(None)
    counted.pytest_sessionfinish(session_of())
    assert 0.15 <= json.loads((tmp_path / "cpu.json").read_text())[FILE] < 0.5
