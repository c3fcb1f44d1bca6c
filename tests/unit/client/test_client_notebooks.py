"""The example notebooks are stored without outputs, and short."""

import json
from pathlib import Path

import pytest

import foveacam_client

NOTEBOOKS = sorted((Path(foveacam_client.__file__).parent / "examples").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_a_notebook_is_stored_without_outputs_and_is_short(path: Path) -> None:
    document = json.loads(path.read_text(encoding="utf-8"))
    cells = [cell for cell in document["cells"] if cell["cell_type"] == "code"]

    assert [cell["outputs"] for cell in cells] == [[]] * len(cells)
    assert [cell["execution_count"] for cell in cells] == [None] * len(cells)
    assert len(document["cells"]) <= 15
    assert all(len(cell["source"]) <= 10 for cell in document["cells"])


def test_there_are_three_notebooks() -> None:
    assert len(NOTEBOOKS) == 3
