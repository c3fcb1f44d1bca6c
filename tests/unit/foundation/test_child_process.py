"""A process beside the server: what it tells, its errors, its end on request."""

from pathlib import Path

import pytest

from foveacam_hardware.contract import Cancelled, InvalidInput
from foveacam_server.foundation.child_process import run_child
from foveacam_server.foundation.child_work import ChildProgress

TALKER = """
import json, sys, time
for done in range(3):
    print(json.dumps({"done": done, "total": 3, "note": "", "share": done / 3}), flush=True)
"""
ENDINGS = {
    "talks": "",
    "refuses": 'print(json.dumps({"error": "InvalidInput", "statement": "no frame", "asked": "a", '
    '"found": "b", "remedy": "c"})); sys.exit(1)',
    "breaks": "sys.exit(3)",
    "stays": "time.sleep(1000)",
}


@pytest.fixture(autouse=True)
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, ending in ENDINGS.items():
        (tmp_path / f"child_that_{name}.py").write_text(TALKER + ending)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))


def ignore(_step: ChildProgress) -> None: ...


def test_each_line_is_handed_on() -> None:
    told: list[ChildProgress] = []
    run_child("child_that_talks", [], on_progress=told.append, cancelled=lambda: False)
    assert told == [ChildProgress(done=n, total=3, note="", share=n / 3) for n in range(3)]


def test_its_error_is_raised_here_in_its_own_words() -> None:
    with pytest.raises(InvalidInput, match=r"^no frame; c$") as refused:
        run_child("child_that_refuses", [], on_progress=ignore, cancelled=lambda: False)
    assert (refused.value.asked, refused.value.found, refused.value.remedy) == ("a", "b", "c")


def test_an_end_that_nobody_foresaw_is_an_error() -> None:
    with pytest.raises(RuntimeError, match="status 3"):
        run_child("child_that_breaks", [], on_progress=ignore, cancelled=lambda: False)


def test_it_is_ended_when_its_work_is_no_longer_wanted() -> None:
    told: list[ChildProgress] = []
    with pytest.raises(Cancelled):
        run_child("child_that_stays", [], on_progress=told.append, cancelled=lambda: len(told) == 3)
