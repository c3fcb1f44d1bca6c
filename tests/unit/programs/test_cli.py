"""The program's errors: one line that names the thing and the remedy, a status, never a traceback."""

import json
import math
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

from foveacam_bench import catalogue
from foveacam_bench.figures import Keep
from foveacam_hardware.contract import InvalidInput
from foveacam_server import __version__, cli
from foveacam_server.foundation import bench_package
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.store import DATABASE, Store
from foveacam_server.rig.hardware_thread import early_kernels

ROOT = Path(__file__).parents[3]


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FOVEACAM_DATA", str(tmp_path / "data"))
    return tmp_path / "data"


@pytest.fixture
def taken_port() -> Iterator[int]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield int(listener.getsockname()[1])


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """Run the program and return its exit status."""
    monkeypatch.setattr("sys.argv", ["foveacam", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert isinstance(ended.value.code, int)
    return ended.value.code


def one_line(capsys: pytest.CaptureFixture[str]) -> str:
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1, captured.err
    assert captured.err.startswith("foveacam: ")
    assert "Traceback" not in captured.err + captured.out
    return captured.err


def test_version_is_printed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(monkeypatch, "version") == 0
    assert capsys.readouterr().out.strip() == __version__


def test_port_in_use_is_named_with_a_remedy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], taken_port: int
) -> None:
    assert run(monkeypatch, "serve", "--port", str(taken_port)) != 0
    line = one_line(capsys)
    assert str(taken_port) in line
    assert "--port" in line


@pytest.mark.parametrize(
    ("option", "value", "named"),
    [
        ("--scene", "bnech", ("bnech", "bench")),
        ("--preset", "rig12", ("rig12", "rig120")),
        ("--rig", "nowhere.toml", ("nowhere.toml", "no such file")),
    ],
)
def test_misspelt_choice_names_what_there_is(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    option: str,
    value: str,
    named: tuple[str, str],
) -> None:
    assert run(monkeypatch, "serve", "--port", "0", option, value) == 2
    line = one_line(capsys)
    assert all(name in line for name in named)


def test_unknown_key_of_a_rig_file_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text('kind = "simulated"\nscnee = "bench"\n')
    assert run(monkeypatch, "serve", "--port", "0", "--rig", str(rig)) == 2
    line = one_line(capsys)
    assert "scnee" in line
    assert "rig.toml" in line


def test_scene_file_with_a_typo_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    scene = tmp_path / "mine.toml"
    scene.write_text("this is = not [ TOML")
    assert run(monkeypatch, "serve", "--port", "0", "--scene", str(scene)) == 2
    assert "mine.toml" in one_line(capsys)


def test_setting_of_the_environment_that_does_not_fit_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FOVEACAM_LIVE_FOVEA_HZ", "fast")
    assert run(monkeypatch, "serve", "--port", "0") == 2
    assert "live_fovea_hz" in one_line(capsys)


def test_unknown_bench_names_those_there_are(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, "bench", "rendr") == 2
    line = one_line(capsys)
    assert "rendr" in line
    assert "stream" in line


def test_bench_prints_one_json_object_and_nothing_else(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        catalogue,
        "run_bench",
        lambda name, *, quick, **_folders: {
            "rtt_p50_ms": 0.5,
            "quick": quick,
            "far": [{"m": math.inf}],
        },
    )
    assert run(monkeypatch, "bench", "stream", "--json", "--quick") == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out) == {"rtt_p50_ms": 0.5, "quick": True, "far": [{"m": None}]}
    assert captured.err == ""


def test_bench_prints_a_table_for_people(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(catalogue, "run_bench", lambda name, *, quick, **_folders: {"rtt_p50_ms": 0.51234})
    run(monkeypatch, "bench", "stream")
    assert "0.5123" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("quick", "binning", "used"), [(False, None, 1), (True, None, 2), (True, 1, 1), (False, 2, 2)]
)
def test_a_bench_runs_at_its_own_binning_unless_quick_or_told(
    monkeypatch: pytest.MonkeyPatch, quick: bool, binning: int | None, used: int
) -> None:
    def measured(*, quick: bool, binning: int = 1) -> dict[str, object]:
        return {"binning": binning, "quick": quick}

    monkeypatch.setattr(catalogue, "import_module", lambda name: SimpleNamespace(run=measured))
    found = catalogue.run_bench("calibration", quick=quick, binning=binning)
    assert found == {"binning": used, "quick": quick}


def test_a_bench_that_is_cut_off_has_shown_the_parts_that_it_measured(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def cut_off(*, quick: bool, keep: Keep) -> dict[str, object]:
        keep({"start_s": 1.5, "imports_s": None})
        raise KeyboardInterrupt

    monkeypatch.setattr(catalogue, "import_module", lambda name: SimpleNamespace(run=cut_off))
    with pytest.raises(KeyboardInterrupt):
        catalogue.run_bench("calibration", quick=True)
    shown = capsys.readouterr()
    assert json.loads(shown.err.splitlines()[-1]) == {"start_s": 1.5, "imports_s": None}
    assert shown.out == ""


def test_a_seed_is_for_benches_that_draw_by_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    def drawing(*, quick: bool, seed: int = 14) -> dict[str, object]:
        return {"seed": seed}

    monkeypatch.setattr(catalogue, "import_module", lambda name: SimpleNamespace(run=drawing))
    assert catalogue.run_bench("calibration", quick=True) == {"seed": 14}
    assert catalogue.run_bench("calibration", quick=True, seed=7) == {"seed": 7}
    monkeypatch.setattr(catalogue, "import_module", lambda name: SimpleNamespace(run=lambda quick: {}))
    with pytest.raises(InvalidInput, match="draws nothing by a seed; leave --seed out"):
        catalogue.run_bench("calibration", quick=True, seed=7)


def test_benches_that_are_not_installed_are_told_with_a_remedy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench_package, "find_spec", lambda name: None)
    assert run(monkeypatch, "bench", "render") == 2
    line = one_line(capsys)
    assert "not installed" in line
    assert "pip install --editable" in line


def test_the_command_bench_alone_uses_the_benches() -> None:
    product = [
        path
        for room in ("hardware", "pipeline", "web", "server/foveacam_server", "server/foveacam_client")
        for path in (ROOT / room).rglob("*.py")
    ]
    named = {path.name for path in product if "foveacam_bench" in path.read_text(encoding="utf-8")}
    users = {path.name for path in product if "bench_module" in path.read_text(encoding="utf-8")}
    assert named == {"bench_package.py"}
    assert users == {"bench_package.py", "cli.py"}


def without_kernels(_settings: Settings) -> AbstractContextManager[None]:
    """In place of `kernels_of`: nothing is compiled or loaded."""
    return nullcontext()


def test_data_folder_of_another_server_is_named_with_a_remedy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path
) -> None:
    monkeypatch.setattr(early_kernels, "kernels_of", without_kernels)
    with Store(data):
        assert run(monkeypatch, "serve", "--port", "0") == 1
    line = one_line(capsys)
    assert str(data) in line
    assert "--data" in line


@pytest.mark.parametrize(
    "command",
    [
        ("serve", "--port", "0"),
        ("users", "list"),
        ("retention", "apply"),
        ("backup", "new.tar"),
    ],
    ids=lambda command: command[0],
)
def test_damaged_database_is_named_with_a_remedy_by_every_command(
    command: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    data: Path,
    tmp_path: Path,
) -> None:
    monkeypatch.setattr(early_kernels, "kernels_of", without_kernels)
    monkeypatch.chdir(tmp_path)
    data.mkdir()
    (data / DATABASE).write_bytes(b"no database" * 1000)
    assert run(monkeypatch, *command) == 1
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    last = captured.err.splitlines()[-1]  # a progress bar may stand before it
    assert last.startswith("foveacam: ")
    for part in (str(data / DATABASE), "file is not a database", "foveacam restore FILE.tar --data NEW"):
        assert part in last


@pytest.mark.parametrize(
    ("error", "status", "message"),
    [
        (PermissionError(13, "Permission denied", "/srv/rig.toml"), 1, "/srv/rig.toml: Permission denied"),
        (OSError(28, "No space left on device"), 1, "No space left on device"),
        (UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"), 2, "text that is not UTF-8"),
    ],
)
def test_errors_of_the_system_and_of_text_are_one_line(
    error: Exception,
    status: int,
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def broken(settings: Settings, **_parts: object) -> None:
        raise error

    monkeypatch.setattr("foveacam_server.serving.run_server", broken)
    monkeypatch.setattr(early_kernels, "kernels_of", without_kernels)
    assert run(monkeypatch, "serve") == status
    line = one_line(capsys)
    assert message in line
    assert "unexpected error" not in line


def test_error_that_nobody_foresaw_is_one_line_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(settings: Settings, **_parts: object) -> None:
        raise ZeroDivisionError("a mistake")

    monkeypatch.setattr("foveacam_server.serving.run_server", broken)
    monkeypatch.setattr(early_kernels, "kernels_of", without_kernels)
    assert run(monkeypatch, "serve") == 1
    assert "ZeroDivisionError: a mistake" in one_line(capsys)


def test_doctor_names_what_is_missing_and_fails(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, taken_port: int
) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text('kind = "serial"\nrig_id = "workshop"\n[mirrors]\nport = "/dev/ttyNOBODY"\n')
    assert run(monkeypatch, "doctor", "--rig", str(rig), "--port", str(taken_port), "--json") == 1
    report = json.loads(capsys.readouterr().out)
    assert report["ok"] is False
    found = report["checks"]
    assert found["rig"]["level"] == "ok"
    for name in ("mirrors", "wide", "left", "right", "serial_ports", "calibration", "port"):
        assert found[name]["level"] == "problem", name
    assert "/dev/ttyNOBODY" in found["mirrors"]["found"]
    assert found["mirrors"]["remedy"]
    assert found["data"]["level"] == "ok"
    assert found["console"]["level"] == "ok"


def test_the_commands_are_listed_without_loading_what_one_of_them_needs() -> None:
    heavy = ("alembic", "cv2", "fastapi", "numba", "scipy", "sqlalchemy", "viser")
    program = f"import sys, foveacam_server.cli; print([name for name in {heavy} if name in sys.modules])"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


MOST_MODULES = 1900
"""Modules of a server's start: 1807 on Linux with Python 3.11."""


def test_a_server_starts_without_what_only_some_need_and_with_few_modules() -> None:
    heavy = (
        "alembic",
        "av",
        "httpx",
        "jinja2",
        "joblib",
        "matplotlib",
        "numba",
        "pygments",
        "scipy",
        "shapely",
        "torch",
    )
    program = (
        f"import sys, foveacam_server.serving; print([name for name in {heavy} if name in sys.modules]); "
        "print(len(sys.modules))"
    )
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    loaded, count = found.stdout.splitlines()
    assert loaded == "[]"
    assert 1000 < int(count) <= MOST_MODULES
