"""The client's notebooks, executed as they stand against the simulated rig."""

import os
from collections.abc import Callable
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

import foveacam_client
from tests.support.servers.running_server import Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("grey")]

PLACE = Path(foveacam_client.__file__).parent
EXAMPLES = PLACE / "examples"
FOUND = {
    "first_click": ("<iframe sandbox=", "image/png", "both_foveae", "first-click.glb"),
    "raster_to_training_set": ("6 of 6", "RemotePoint(index=5", "torch.Size([2, 3, 1080, 1440])"),
    "calibration_report": ("baseline", "FixationResult(", "HealthDocument(", "bytes"),
}
"""What is in the outputs of each notebook."""


@pytest.fixture
def execute(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., nbformat.NotebookNode]:
    """Execute a notebook in an empty folder; nothing is written to the user's home."""
    search = os.pathsep.join([str(PLACE.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    monkeypatch.setenv("PYTHONPATH", search)
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    for name in ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))
    folder = tmp_path / "work"
    folder.mkdir()

    def run(name: str, *, url: str) -> nbformat.NotebookNode:
        monkeypatch.setenv("FOVEACAM_URL", url)
        text = (EXAMPLES / f"{name}.ipynb").read_text(encoding="utf-8")
        notebook = nbformat.reads(text, as_version=4)  # type: ignore[no-untyped-call]  # it states no types
        resources = {"metadata": {"path": str(folder)}}
        return NotebookClient(notebook, timeout=120, kernel_name="python3", resources=resources).execute()

    return run


@pytest.mark.parametrize("name", FOUND)
def test_a_notebook_runs_as_it_stands(
    name: str, execute: Callable[..., nbformat.NotebookNode], api_server: Running
) -> None:
    made = execute(name, url=f"http://127.0.0.1:{api_server.port}")

    outputs = str([cell.get("outputs") for cell in made.cells])
    assert [words for words in FOUND[name] if words not in outputs] == []


def test_every_notebook_is_executed() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.ipynb")} == set(FOUND)


def test_a_notebook_without_a_server_says_what_to_do(
    execute: Callable[..., nbformat.NotebookNode],
) -> None:
    with pytest.raises(CellExecutionError, match="`foveacam serve` starts one"):
        execute("first_click", url="http://127.0.0.1:9")  # discard: nobody listens
