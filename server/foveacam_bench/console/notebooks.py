"""The example notebooks of the client, executed as they stand against a server."""

import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import foveacam_client
from foveacam_bench.figures import Figures, Report
from foveacam_bench.progress import show_note

PACKAGE = Path(foveacam_client.__file__).parent
EXAMPLES = PACKAGE / "examples"
QUICK_NOTEBOOK = "first_click"
CELL_S = 120
"""Most seconds of one cell."""
_EXECUTE = "from nbclient.cli import main; main()"
_FOLDERS = ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR")
"""Variables with folders into which Jupyter writes; else it would write to the user's home."""


def notebook_figures(url: str, *, quick: bool, report: Report) -> Figures:
    """Execute the notebooks; return how many ran to their end, and of how many; `quick`: one.

    Null where nbclient is not installed.
    """
    chosen = [EXAMPLES / f"{QUICK_NOTEBOOK}.ipynb"] if quick else sorted(EXAMPLES.glob("*.ipynb"))
    if find_spec("nbclient") is None:
        return {"notebooks_run": None, "notebooks": len(chosen)}
    ran = 0
    for path in chosen:
        report(f"notebook {path.stem}")
        problem = execute_notebook(path, url=url)
        ran += problem is None
        if problem is not None:
            show_note(f"notebook {path.stem}: {problem}")
    return {"notebooks_run": ran, "notebooks": len(chosen)}


def execute_notebook(notebook: Path, *, url: str) -> str | None:
    """Execute a copy in an empty folder; return why it did not reach its end, None where it did."""
    with TemporaryDirectory(prefix="foveacam-notebook-") as name:
        folder = Path(name)
        work = folder / "work"
        work.mkdir()
        copy = shutil.copy(notebook, work)
        command = [sys.executable, "-c", _EXECUTE, f"--timeout={CELL_S}", "--kernel_name=python3", str(copy)]
        done = subprocess.run(  # noqa: S603 - our own notebook
            command, capture_output=True, text=True, check=False, cwd=work, env=_environment(folder, url)
        )
    return None if done.returncode == 0 else done.stderr.strip()[-500:]


def _environment(folder: Path, url: str) -> dict[str, str]:
    search = [str(PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {
        **os.environ,
        **{variable: str(folder / variable.lower()) for variable in _FOLDERS},
        "FOVEACAM_URL": url.rstrip("/"),
        "JUPYTER_PLATFORM_DIRS": "1",
        "PYTHONPATH": os.pathsep.join(search),
    }
