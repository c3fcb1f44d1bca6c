"""The program in a locale whose encoding has few characters."""

import os
import subprocess
import sys
from pathlib import Path

ASCII = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}
"""A locale that Python itself does not replace by one of UTF-8."""
NAME = "Schnee \u2603 \u6728"
WRITES = """
import sys
from pathlib import Path
from foveacam_server.__main__ import ensure_utf8
ensure_utf8()
Path(sys.argv[1], "Schnee \\u2603 \\u6728").write_text("\\u6728")
print("\\u2603")
"""


def run(*words: str) -> "subprocess.CompletedProcess[bytes]":
    return subprocess.run([sys.executable, *words], env={**os.environ, **ASCII}, capture_output=True)


def test_file_names_files_and_output_are_utf8(tmp_path: Path) -> None:
    result = run("-c", WRITES, str(tmp_path))
    assert (result.returncode, result.stdout.decode()) == (0, "\u2603\n"), result.stderr
    assert [path.name for path in tmp_path.iterdir()] == [NAME]
    assert (tmp_path / NAME).read_bytes().decode() == "\u6728"


def test_a_name_of_the_command_line_is_read_as_it_was_written() -> None:
    result = run("-m", "foveacam_server", "still", "--name", NAME, "--server", "nowhere")
    assert result.stderr.decode().startswith("foveacam: 'nowhere' is no address"), result.stderr
