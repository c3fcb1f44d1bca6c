"""The catalogue of benches: durations, what is missing, progress, and the same figures of quick runs."""

import ast
import json
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from foveacam_bench import catalogue, progress
from foveacam_bench.catalogue import BENCHES, QUICK_S, bench_names, run_bench
from foveacam_bench.faults.tally import KINDS, FaultTally
from foveacam_bench.figures import Figures, Report
from foveacam_bench.pace import long_jobs
from foveacam_bench.pace.reference import with_multiples
from foveacam_bench.progress import duration_text
from foveacam_bench.verge import field_clicks
from foveacam_hardware.contract import NotConnected
from foveacam_pipeline.verge.values import Basis, Fixation, FixationState
from foveacam_server import cli

SOURCES = Path(catalogue.__file__).parent


@pytest.mark.parametrize("name", bench_names())
def test_every_bench_states_its_duration_and_takes_quick(name: str) -> None:
    bench = BENCHES[name]
    least_s, most_s = bench.whole_s
    assert 0 < least_s < most_s <= 2 * 3600
    tree = ast.parse((SOURCES / f"{bench.module.replace('.', '/')}.py").read_text(encoding="utf-8"))
    (run,) = (one for one in tree.body if isinstance(one, ast.FunctionDef) and one.name == "run")
    assert "quick" in {argument.arg for argument in run.args.kwonlyargs}


def test_quick_chooses_how_much_is_measured_and_leaves_no_figure_out() -> None:
    sources = sorted(SOURCES.rglob("*.py"))
    trees = {path.relative_to(SOURCES): ast.parse(path.read_text(encoding="utf-8")) for path in sources}
    assert len(trees) > 100
    assert [f"{path}:{node.lineno}" for path, tree in trees.items() for node in left_out(tree)] == []


@pytest.mark.parametrize(
    "statement",
    ["if quick:\n    a = 1", "if not quick:\n    a = 1", "a = {k: 1 for k in 'ab' if not quick}"],
)
def test_a_figure_that_quick_leaves_out_is_found(statement: str) -> None:
    assert list(left_out(ast.parse(statement)))
    assert not list(left_out(ast.parse("figures = measure(2 if quick else 20, quick=quick)")))


def left_out(tree: ast.Module) -> Iterator[ast.expr]:
    """Yield the conditions by which something is done only in a quick run, or only in a whole one."""
    for node in ast.walk(tree):
        tests = [node.test] if isinstance(node, ast.If | ast.While) else []
        for test in node.ifs if isinstance(node, ast.comprehension) else tests:
            if any(isinstance(each, ast.Name) and each.id == "quick" for each in ast.walk(test)):
                yield test


def test_figures_do_not_depend_on_what_happened_to_be_measured() -> None:
    unanswered = click(None)
    every = [unanswered, *(click(basis) for basis in Basis)]
    assert field_clicks.figures([unanswered]).keys() == field_clicks.figures(every).keys()

    tally = FaultTally()
    before = tally.figures().keys()
    for kind in KINDS:
        tally.add_fault(kind=kind, detected_s=0.1, recovered_s=0.2, parked=True)
    assert tally.figures().keys() == before

    times: list[Figures] = [{"ready_s": None}, {"ready_s": 2.0}]
    unknown, known = (with_multiples(one, reference_ms=40.0) for one in times)
    assert unknown == {"reference_ms": 40.0, "ready_s": None, "ready_s_over_reference": None}
    assert known == {"reference_ms": 40.0, "ready_s": 2.0, "ready_s_over_reference": 50.0}


def click(basis: Basis | None) -> field_clicks.JudgedClick:
    """Return a click on a surface 10 m away that was answered by a basis, or not at all."""
    distance_m = None if basis in (None, Basis.BOUND) else 10.1
    fixation = Fixation(
        state=FixationState.VERGED,
        reason="",
        target_ax_rad=0.0,
        target_ay_rad=0.0,
        steps=(),
        distance_m=distance_m,
        distance_sigma_m=distance_m and 0.1,
        basis=basis,
    )
    return field_clicks.JudgedClick(
        scene="bench",
        pixel=(700.0, 500.0),
        name="poster",
        seen_by="both",
        range_m=10.0,
        fixation=fixation,
        off_centre_px=1.0,
    )


def test_a_quick_run_has_the_figures_of_calibrations_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_figures(folder: Path, **_options: object) -> Figures:
        return {}

    def calibrate(folder: Path) -> Figures:
        return dict.fromkeys(long_jobs.OF_CALIBRATIONS, 1.0)

    monkeypatch.setattr(long_jobs, "raster_figures", no_figures)
    monkeypatch.setattr(long_jobs, "look_around_figures", no_figures)
    monkeypatch.setattr(long_jobs, "all_calibration_figures", calibrate)
    quick, whole = (long_jobs.long_job_figures(tmp_path, quick=quick) for quick in (True, False))
    assert quick.keys() == whole.keys()
    assert set(quick.values()) == {None}


def test_a_bench_says_at_once_what_it_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    def load(name: str) -> SimpleNamespace:
        raise AssertionError(f"{name} was loaded")

    monkeypatch.setattr(catalogue, "import_module", load)
    lacking = replace(BENCHES["doors"], needs=("json", "no_such_package", "no-such-program-0.8"))
    monkeypatch.setattr(catalogue, "BENCHES", {"doors": lacking})
    with pytest.raises(NotConnected, match=r"no_such_package and no-such-program-0\.8") as refused:
        run_bench("doors", quick=True)
    assert "foveacam-duo[dev]" in str(refused.value)


@pytest.mark.parametrize("quick", [True, False])
def test_duration_and_progress_are_shown_beside_one_json_object(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], quick: bool
) -> None:
    shown = threading.Event()

    def measured(*, quick: bool, report: Report) -> Figures:
        report("hour 2 of 24")
        shown.wait(10.0)
        return {"quick": quick}

    def tick(console: Console, text: str, *more: str, sep: str = " ") -> None:
        print_it(console, text, *more, sep=sep)
        if "hour 2 of 24" in text:
            shown.set()

    print_it = Console.print
    monkeypatch.setattr(Console, "print", tick)
    monkeypatch.setattr(progress, "LINE_PERIOD_S", 0.01)
    monkeypatch.setattr(catalogue, "import_module", lambda name: SimpleNamespace(run=measured))
    bench = replace(BENCHES["soak"], whole_s=(2400, 3000), uses=("no_such_package",))
    monkeypatch.setattr(catalogue, "BENCHES", {"soak": bench})
    monkeypatch.setattr("sys.argv", ["foveacam", "bench", "soak", "--json", *["--quick"] * quick])
    with pytest.raises(SystemExit) as ended:
        cli.main()

    captured = capsys.readouterr()
    assert (ended.value.code, json.loads(captured.out)) == (0, {"quick": quick})
    takes = f"meant for {QUICK_S} s" if quick else "40 to 50 min"
    first, second = captured.err.splitlines()[:2]
    assert first == f"bench soak: {takes} on two cores; without no_such_package some figures are null"
    assert second.startswith("bench soak: hour 2 of 24, 0 s (")


def test_durations_are_stated_in_a_unit_that_suits_them() -> None:
    assert [duration_text(limits_s) for limits_s in ((0, 90), (20, 40), (100, 200), (1200, 1800))] == [
        *("meant for 90 s", "20 to 40 s", "1 to 4 min", "20 to 30 min")
    ]
