"""The example resource of CONTRIBUTING.md, built from that page as it is printed there."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from foveacam_server.assembly import routers
from foveacam_server.resources import looking
from tests.support.servers.running_server import missing_rig, running

PAGE = Path(__file__).parents[2] / "CONTRIBUTING.md"
FILES = ("schema.py", "service.py", "routes.py")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The example's folder, as the page prints it."""
    section = PAGE.read_text(encoding="utf-8").split("## Add a resource")[1].split("\n## ")[0]
    blocks = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    made = tmp_path / "greeting"
    made.mkdir()
    (made / "__init__.py").write_text('"""The greeting."""\n', encoding="utf-8")
    for name, block in zip(FILES, blocks, strict=True):
        (made / name).write_text(block, encoding="utf-8")
    return made


def test_its_three_files_and_one_line_answer(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(looking, "__path__", [*looking.__path__, str(folder.parent)])
    monkeypatch.setattr(routers, "MODULES", (*routers.MODULES, "looking.greeting.routes"))
    with running(tmp_path / "data", rig=missing_rig(tmp_path)) as server:
        answer = server.get("/greeting", visitor="Ada")
        assert answer.json() == {"words": f"{server.get('/rig').json()['name']} greets Ada"}
        assert server.get("/greeting").status_code == 422
        assert server.post("/greeting").status_code == 405


def test_it_is_in_the_house_style(folder: Path) -> None:
    ruff = Path(sys.executable).with_name("ruff")
    for name in FILES:
        at = f"server/foveacam_server/resources/looking/greeting/{name}"
        for check in (["check", "--ignore", "I001"], ["format", "--check"]):  # it is in no folder yet
            told = subprocess.run(
                [ruff, *check, "--stdin-filename", at, "-"],
                input=(folder / name).read_text(encoding="utf-8"),
                cwd=PAGE.parent,
                capture_output=True,
                text=True,
                check=False,
            )
            assert told.returncode == 0, told.stdout + told.stderr
