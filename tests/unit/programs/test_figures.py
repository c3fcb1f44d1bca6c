"""Figures of the pages: how tables are rendered from stored runs, and which runs are out of date."""

import importlib
import json
import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

ROOT = Path(__file__).parents[3]
BENCH = "serial"
"""It imports few files, and starts two programs by name."""
RUNS = {"a": {"share": 0.98765, "count": 20500, "ok": True, "lost": None}, "b --seed 2": {"share": 1.0}}


@pytest.fixture(scope="module")
def program() -> Iterator[SimpleNamespace]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [str(ROOT / ".ci"), *sys.path])
        names = ("figures", "figure_runs", "figure_sources", "figure_tables")
        yield SimpleNamespace(**{name: importlib.import_module(name) for name in names})


@pytest.fixture
def runs(program: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.setattr(program.figure_runs, "reference_ms", lambda: 40.0)
    module = program.figure_runs
    assert isinstance(module, ModuleType)
    return module


def table(*rows: str, mark: str = "<!-- figures: a | - -->") -> str:
    return "\n".join([mark, "| figure | measured | bar |", "|---|---|---|", *rows, "", "After."])


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ("| `share` | 0.5 | ≤ 1 |", "| `share` | 0.988 | ≤ 1 |"),
        (
            "| `share`: x, `count` | 0.5 (0.4 once) | – |",
            "| `share`: x, `count` | 0.988, 20 500 (0.4 once) | – |",
        ),
        ("| `ok`; `lost` | ? | – |", "| `ok`; `lost` | true, – | – |"),
        ("| nothing in backticks | 3 | – |", "| nothing in backticks | 3 | – |"),
    ],
)
def test_cells_get_the_figures_that_the_row_names(program: SimpleNamespace, row: str, expected: str) -> None:
    assert program.figure_tables.rendered(table(row), RUNS, page="A.md") == (table(expected), [])


def test_each_column_has_a_run_of_its_own(program: SimpleNamespace) -> None:
    mark = "<!-- figures: b --seed 2 | a -->"
    text, problems = program.figure_tables.rendered(table("| `share` | | |", mark=mark), RUNS, page="A.md")
    assert (text, problems) == (table("| `share` | 1.0 | 0.988 |", mark=mark), [])


@pytest.mark.parametrize("mark", ["", "<!-- a comment -->", "Text with `<!-- figures: a | - -->` in it."])
def test_a_table_without_a_mark_stays(program: SimpleNamespace, mark: str) -> None:
    text = table("| `share` | 0.5 | ≤ 1 |", mark=mark)
    assert program.figure_tables.rendered(text, RUNS, page="A.md") == (text, [])


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (0.00612, "0.00612"),
        (45.0, "45.0"),
        (145.2, "145"),
        (999.7, "1 000"),
        (6.04e-11, "6.04e-11"),
        (5e-5, "5e-5"),
        (-7.0, "-7.0"),
        (149042, "149 042"),
        ("two", "two"),
    ],
)
def test_figures_have_three_digits(program: SimpleNamespace, value: object, expected: str) -> None:
    assert program.figure_tables.shown(value) == expected


@pytest.mark.parametrize(
    ("row", "mark", "words"),
    [
        ("| `share`, `shared` | 1 | – |", "a | -", "A.md:4: row '`share`, `shared`': 'a' has no figure"),
        ("| `share` | 1 |", "a | -", "A.md:4: row '`share`' has 1 values for 2 columns"),
        ("| `share` | 1 | – |", "a", "A.md:1: 1 runs are named for 2 columns"),
        ("| `share` | 1 | – |", "a | c", "A.md:1: no run 'c' is stored"),
    ],
)
def test_a_row_that_cannot_be_filled_stays_and_is_named(
    program: SimpleNamespace, row: str, mark: str, words: str
) -> None:
    text = table(row, mark=f"<!-- figures: {mark} -->")
    found, [problem] = program.figure_tables.rendered(text, RUNS, page="A.md")
    assert found == text
    assert problem.startswith(words)


def test_a_mark_without_a_table_is_named(program: SimpleNamespace) -> None:
    _, [problem] = program.figure_tables.rendered("<!-- figures: a -->\n\nText.\n", RUNS, page="A.md")
    assert problem.startswith("A.md:1: no table follows")


def test_a_run_is_out_of_date_when_a_file_that_its_bench_imports_changes(
    program: SimpleNamespace, runs: ModuleType, tmp_path: Path
) -> None:
    paths = program.figure_sources.source_paths(BENCH)
    for path in paths:
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, tmp_path / path)
    code = program.figure_sources.code_now(BENCH)
    stored = {BENCH: runs.described(BENCH, "{}", code=code, printed=program.figures.datetime.now())}

    unrelated = tmp_path / "hardware/foveacam_hardware/sim/scene.py"
    assert unrelated.relative_to(tmp_path).as_posix() not in paths
    unrelated.write_text("CHANGED = True\n")
    assert list(runs.stale_lines(stored, root=tmp_path)) == []

    changed = "hardware/foveacam_hardware/sim/far_ends/controller_process.py"
    with (tmp_path / changed).open("a") as file:
        file.write("# changed\n")
    (line,) = runs.stale_lines(stored, root=tmp_path)
    assert line.startswith(f"{BENCH}: 1 file changed since {code.commit} (")
    assert line.endswith(changed)


def test_programs_that_are_started_and_data_beside_the_code_belong_to_it(program: SimpleNamespace) -> None:
    started = program.figure_sources.source_paths(BENCH)
    assert "hardware/foveacam_hardware/sim/far_ends/controller_main.py" in started
    assert "server/foveacam_server/app.py" not in started
    sources = program.figure_sources.source_paths("truth")
    assert "hardware/foveacam_hardware/sim/scenes/street.toml" in sources
    assert "server/foveacam_server/resources/calibrating/calibrations/shipped/sim-rig120.json" in sources
    assert "server/foveacam_server/app.py" in program.figure_sources.source_paths("doors")


def test_an_output_is_stored_with_its_code_and_without_long_lists(
    program: SimpleNamespace, runs: ModuleType, tmp_path: Path
) -> None:
    output, file = tmp_path / "serial.json", tmp_path / "figures.json"
    output.write_text(json.dumps({"rtt_p50_ms": 0.1, "each_ms": [0.1] * 1000}))
    run = program.figures.printed_before(BENCH, output, commit=None)
    runs.store(BENCH, run, file=file)
    runs.store("truth --seed 5", run, file=file)
    assert runs.load(file) == {BENCH: run, "truth --seed 5": run}
    assert (run.figures, run.left_out, run.reference_ms) == ({"rtt_p50_ms": 0.1}, ["each_ms"], 40.0)
    assert run.code == program.figure_sources.code_now(BENCH)
    assert "cores" in run.machine
    assert len(file.read_text().splitlines()) == 4


def test_a_bench_is_run_by_its_command_line_and_nothing_is_stored_when_it_fails(
    program: SimpleNamespace, runs: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = program.figure_sources.Code(commit="1", uncommitted=[], sources={})
    monkeypatch.setattr(program.figures, "code_now", lambda bench: code)
    done = SimpleNamespace(returncode=0, stdout='{"seed": 5}')
    commands: list[list[str]] = []

    def run(command: list[str], **_: object) -> SimpleNamespace:
        commands.append(command)
        return done

    monkeypatch.setattr(program.figures, "subprocess", SimpleNamespace(PIPE=-1, run=run))
    assert program.figures.measured("truth --seed 5").figures == {"seed": 5}
    assert commands[0][2:] == ["foveacam_server", "bench", "truth", "--seed", "5", "--json"]
    done.returncode = 2
    with pytest.raises(SystemExit, match="`foveacam bench truth --seed 5` failed, as said above"):
        program.figures.measured("truth --seed 5")


def test_an_output_older_than_the_code_needs_the_commit_it_measured(
    program: SimpleNamespace, runs: ModuleType, tmp_path: Path
) -> None:
    output = tmp_path / "serial.json"
    output.write_text("{}")
    os.utime(output, (0.0, 0.0))
    with pytest.raises(SystemExit, match=r"is older than \d+ of the files .* by --commit"):
        program.figures.printed_before(BENCH, output, commit=None)
    run = program.figures.printed_before(BENCH, output, commit="HEAD")
    assert run.date == "1970-01-01T00:00:00Z"
    assert run.code.hashes().keys() <= set(program.figure_sources.source_paths(BENCH))


@pytest.mark.parametrize(
    ("name", "output", "words"),
    [
        ("serial", "no JSON", "no JSON object was printed for 'serial'; foveacam bench serial --json"),
        ("serial", "[1]", "no JSON object"),
        ("serial", b"\xff", "no JSON object"),
        ("truth --seed 5", '{"seed": 6}', "the output is of seed 6, not of 'truth --seed 5'"),
    ],
)
def test_an_output_that_is_not_the_run_s_is_refused(
    program: SimpleNamespace, runs: ModuleType, name: str, output: str | bytes, words: str
) -> None:
    code = program.figure_sources.Code(commit="", uncommitted=[], sources={})
    with pytest.raises(SystemExit, match=words):
        runs.described(name, output, code=code, printed=program.figures.datetime.now())


def test_what_cannot_be_found_is_named(program: SimpleNamespace, runs: ModuleType, tmp_path: Path) -> None:
    assert runs.run_name(" truth  --seed 5 --json") == "truth --seed 5"
    for command in ("truths", "truth 'a", ""):
        with pytest.raises(
            SystemExit, match=f"'{command}' names no bench; begin with one of accept, archive, "
        ):
            runs.run_name(command)
    with pytest.raises(SystemExit, match=r"there is no file .*gone\.json"):
        program.figures.printed_before(BENCH, tmp_path / "gone.json", commit=None)
    with pytest.raises(SystemExit, match="git knows no 'gone'"):
        program.figure_sources.code_at(BENCH, "gone")
    (tmp_path / "figures.json").write_text('{"serial": {}}')
    with pytest.raises(SystemExit, match="has no runs in it"):
        runs.load(tmp_path / "figures.json")


def test_a_page_that_differs_is_named_by_the_check_and_rendered_without_it(
    program: SimpleNamespace, runs: ModuleType, tmp_path: Path
) -> None:
    code = program.figure_sources.Code(commit="", uncommitted=[], sources={})
    stored = {"a": runs.described("a", '{"share": 0.5}', code=code, printed=program.figures.datetime.now())}
    page = tmp_path / "server" / "FIGURES.md"
    page.parent.mkdir()
    page.write_text(table("| `share` | 0.4 | – |"), encoding="utf-8")
    [problem] = program.figures.render(stored, root=tmp_path, check=True)
    assert problem.startswith("server/FIGURES.md: its tables are not those of server/figures.json; run 'make")
    assert program.figures.render(stored, root=tmp_path) == []
    assert page.read_text(encoding="utf-8") == table("| `share` | 0.5 | – |")
    assert program.figures.render(stored, root=tmp_path, check=True) == []


def test_the_pages_show_the_stored_figures(program: SimpleNamespace, runs: ModuleType) -> None:
    stored = runs.load(runs.FILE)
    assert stored
    assert program.figures.render(stored, check=True) == []
