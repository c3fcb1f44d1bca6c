"""`foveacam study`: what it prints and writes, what it keeps, what Ctrl-C leaves, what it refuses."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import typer
from matplotlib.figure import Figure

from foveacam_hardware.contract import DeviceFault, InvalidInput
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.learn.pair_folder import DOCUMENT, Split, StoredPairs
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.study.report.findings import (
    Drawing,
    PaperComparison,
    StudyFigure,
    StudyResult,
    drawing_of,
)
from foveacam_pipeline.study.tradeoff.rig_pairs import RigPairScene
from foveacam_pipeline.study.visibility.toy_scene import SCENE, AgentPose
from foveacam_pipeline.workers.progress import SILENT, ProgressSteps, ProgressWatcher
from foveacam_server import cli
from foveacam_server.resources.studying.studies import recipes as study_recipes
from foveacam_server.resources.studying.studies import trained_networks, truth_measurements
from foveacam_server.resources.studying.studies.cli import StudyName
from foveacam_server.resources.studying.studies.recipes import CERTIFICATE, StudyOrder, StudyRecipe, recipes
from foveacam_server.resources.studying.studies.run import ReportOptions, catch_ctrl_c, run_studies
from foveacam_server.resources.studying.studies.simulated_rigs import pose_setter
from foveacam_server.resources.studying.studies.truth_measurements import wide_pair


@pytest.fixture(autouse=True)
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "cache" / "foveacam" / "studies"


def drawn() -> Drawing:
    figure = Figure(figsize=(2.0, 1.0))
    figure.subplots().plot([1.0, 2.0])
    return drawing_of(figure)


def recipe(
    name: str, work: Callable[[ProgressWatcher], None] = lambda _watch: None
) -> tuple[StudyRecipe, list[str]]:
    computed: list[str] = []

    def compute(watch: ProgressWatcher) -> StudyResult:
        computed.append(name)
        work(watch)
        return StudyResult(
            name=name,
            section="4.1",
            title=f"About {name}",
            values={"ratio": 9.1},
            rows=(PaperComparison(quantity="ratio [m]", paper="about 9", ours="9.1"),),
            pictures=(StudyFigure(name="curve", title="Curve", caption="", drawing=drawn()),),
            seeds={"noise": 3},
        )

    return StudyRecipe(
        name=name, settings={"quick": True}, files=(Path(__file__),), compute=compute
    ), computed


def ctrl_c(watch: ProgressWatcher) -> None:
    os.kill(os.getpid(), signal.SIGINT)
    steps = ProgressSteps(watch, 1_000_000, ended="cancelled")
    for _ in range(1_000_000):
        steps.step("on and on")


def ctrl_c_twice(watch: ProgressWatcher) -> None:
    os.kill(os.getpid(), signal.SIGINT)
    until_s = time.monotonic() + 20.0
    while not watch.cancelled() and time.monotonic() < until_s:
        pass
    os.kill(os.getpid(), signal.SIGINT)
    while time.monotonic() < until_s:  # deaf to the first one
        pass


def broken(_watch: ProgressWatcher) -> None:
    raise DeviceFault("the rig was lost; connect it")


def test_a_table_the_drawings_and_the_report(capsys: pytest.CaptureFixture[str]) -> None:
    run_studies([recipe("one")[0]], ReportOptions(out=Path("told")))
    printed = capsys.readouterr().out
    for words in ("paper", "ours", "about 9", "ratio [m]", "told/report.html"):
        assert words in printed
    assert sorted(path.name for path in Path("told").iterdir()) == [
        "one-curve.png",
        "one-curve.svg",
        "one.json",
        "report.html",
    ]
    assert "<svg" in Path("told/one-curve.svg").read_text()
    assert Path("told/one-curve.png").read_bytes() == drawn().png
    assert "1 picture (SVG and PNG) in told" in printed
    assert "About one" in Path("told/report.html").read_text()
    assert json.loads(Path("told/one.json").read_text())["ratio"] == 9.1


def test_what_is_kept_is_not_computed_again_unless_asked(
    capsys: pytest.CaptureFixture[str], kept: Path
) -> None:
    one, computed = recipe("one")
    for fresh in (False, False, True):
        run_studies([one], ReportOptions(as_json=True, fresh=fresh))
    printed = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [document["kept"] for document in printed] == [False, True, False]
    assert printed[0]["ratio"] == printed[1]["ratio"] == 9.1
    assert printed[0]["seeds"] == {"noise": 3}
    assert len(computed) == 2
    (file,) = kept.iterdir()
    file.write_bytes(file.read_bytes()[:-40])
    run_studies([one], ReportOptions(as_json=True))
    said = capsys.readouterr()
    assert "not as it was written" in said.err
    assert file.name in said.err
    assert json.loads(said.out)["kept"] is False
    assert len(computed) == 3


@pytest.mark.parametrize("ended_by", [ctrl_c, ctrl_c_twice])
def test_ctrl_c_leaves_what_is_finished_and_says_what_is_not(
    capsys: pytest.CaptureFixture[str], ended_by: Callable[[ProgressWatcher], None]
) -> None:
    (first, _), (second, _), (third, never) = recipe("one"), recipe("two", ended_by), recipe("three")
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(typer.Exit) as ended:
        run_studies([first, second, third], ReportOptions(out=Path("told"), every=True))
    assert ended.value.exit_code == 130
    assert not never
    assert "two: ended before it was finished" in capsys.readouterr().err
    page = Path("told/report.html").read_text()
    assert "About one" in page
    assert "two: ended before" in page
    assert signal.getsignal(signal.SIGINT) is before
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
    assert not [thread for thread in threading.enumerate() if thread.name == "ctrl-c"]


def test_a_study_that_ended_early_is_reported_and_not_kept(
    capsys: pytest.CaptureFixture[str], kept: Path
) -> None:
    (whole, computed), (third, never) = recipe("one"), recipe("three")

    def partly(watch: ProgressWatcher) -> StudyResult:
        os.kill(os.getpid(), signal.SIGINT)
        until_s = time.monotonic() + 20.0
        while not watch.cancelled() and time.monotonic() < until_s:
            pass
        return replace(whole.compute(watch), ended_early="ended early with 37 of 96 positions")

    with pytest.raises(typer.Exit) as ended:
        run_studies([replace(whole, compute=partly), third], ReportOptions(out=Path("told"), every=True))
    assert ended.value.exit_code == 130
    assert (computed, never) == (["one"], [])
    assert "one: ended early with 37 of 96 positions" in capsys.readouterr().err
    assert "37 of 96" in Path("told/report.html").read_text()
    assert Path("told/one.json").exists()
    assert not kept.exists()


def test_worker_processes_do_not_hear_ctrl_c() -> None:
    blocked = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))"
    with catch_ctrl_c(lambda: None):
        child = subprocess.run([sys.executable, "-c", blocked], capture_output=True, check=True)
    assert child.stdout.strip() == b"True"


def test_one_study_that_fails_stops_no_other_when_all_are_asked_for(
    capsys: pytest.CaptureFixture[str],
) -> None:
    (bad, _), (good, _) = recipe("bad", broken), recipe("good")
    with pytest.raises(typer.Exit) as ended:
        run_studies([bad, good], ReportOptions(as_json=True, every=True))
    assert ended.value.exit_code == 1
    said = capsys.readouterr()
    assert list(json.loads(said.out)) == ["good"]
    assert "bad: the rig was lost" in said.err
    with pytest.raises(DeviceFault, match="connect it"):
        run_studies([bad], ReportOptions(as_json=True))


def write_errors() -> None:
    """Write the matching errors that two benches measured."""
    Path("verge.json").write_text('{"clicks": 3, "residual_median_px": 0.125}')
    Path("stereo.json").write_text('{"epe_px": 0.5, "rendered_median_error_px": 0.0625, "bad1": 0.1}')


def test_the_program_tells_a_study_as_one_json_object(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_errors()  # with them the rig need not look
    words = ["depth", "--quick", "--matching-error", "verge.json", "--matching-error", "stereo.json"]
    monkeypatch.setattr("sys.argv", ["foveacam", "study", *words, "--json", "--out", "told"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["matching_error_verge_px"] == 0.125
    assert {"seeds", "took_s"} <= set(printed)
    assert printed["report"] == "told/report.html"
    assert Path(printed["report"]).exists()


@pytest.mark.parametrize(
    ("words", "remedy"),
    [
        (["tokens", "--vkitti", "somewhere"], "leave it out"),
        (["depth", "--maps", "3"], "leave them out"),
        (["standoff", "--jobs", "0"], "-1"),
        (["fig8", "--cluster", "127.0.0.1:1"], "leave them out"),
        (["tokens", "--matching-error", "0.1"], "leave it out"),
        (["depth", "--matching-error", "nan"], "must exceed 0 px"),
        (["depth", "--matching-error", "nowhere.json"], "foveacam bench stereo --json > FILE"),
        (["depth", "--matching-error", "1", "--matching-error", "2"], "give it once"),
        (["tradeoff", "--vkitti", "nowhere", "--quick"], "nowhere"),
    ],
)
def test_what_a_study_cannot_take_is_refused_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str], remedy: str
) -> None:
    monkeypatch.setattr("sys.argv", ["foveacam", "study", "--json", *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.startswith("foveacam: ")
    assert remedy in line


def test_the_curves_of_the_depth_error_are_drawn_with_what_benches_measured() -> None:
    write_errors()
    order = StudyOrder(matching_errors=("verge.json", "stereo.json", "0.25"))
    (made,) = recipes(order, ["depth"])
    study = made.compute(SILENT)  # the rig does not look where its residual is given
    found = {
        key: study.values[f"matching_error_{key}_px"] for key in ("verge", "stereo", "rendered", "given")
    }
    assert found == {"verge": 0.125, "stereo": 0.5, "rendered": 0.0625, "given": 0.25}
    notes = [row.note for row in study.rows]
    assert any("foveacam bench verge" in note and "(verge.json)" in note for note in notes)
    assert made.settings != recipes(StudyOrder(), ["depth"])[0].settings


@pytest.mark.parametrize("content", ["[0.1]", "{}", '{"epe_px": null}', '{"epe_px": "0.1"}', "no JSON"])
def test_a_file_without_a_matching_error_is_refused(content: str) -> None:
    Path("bench.json").write_text(content)
    with pytest.raises(InvalidInput, match=r"bench\.json.*foveacam bench stereo --json > FILE"):
        recipes(StudyOrder(matching_errors=("bench.json",)), ["depth"])


def test_every_study_has_a_recipe_whose_files_are_there() -> None:
    names = [each.value for each in StudyName if each is not StudyName.ALL]
    found = recipes(StudyOrder(quick=True), names)
    assert sorted(made.name for made in found) == sorted(names)
    for made in found:
        assert made.files
        assert all(path.is_file() for path in made.files)
        json.dumps(made.settings, allow_nan=False)


@pytest.mark.slow
@pytest.mark.usefixtures("without_benches")
def test_the_rig_s_matching_error_is_measured_without_the_benches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study_recipes, "QUICK_CLICKS", 1)
    (made,) = recipes(StudyOrder(quick=True), ["depth"])
    error_px = made.compute(SILENT).values["matching_error_verge_px"]
    assert isinstance(error_px, float)
    assert 0.0 < error_px < 1.0


@pytest.mark.slow
@pytest.mark.usefixtures("without_benches")
def test_the_rig_s_pair_is_measured_without_the_benches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(truth_measurements, "QUICK_COLUMNS_DEG", (0.0,))
    monkeypatch.setattr(truth_measurements, "QUICK_ROWS_DEG", (0.0,))
    pairs: list[RigPairScene] = []

    def noted(*, rig_pairs: tuple[RigPairScene, ...], **_settings: object) -> StudyResult:
        pairs.extend(rig_pairs)
        return recipe("tradeoff")[0].compute(SILENT)

    monkeypatch.setattr("foveacam_pipeline.study.tradeoff.study.tradeoff_study", noted)
    (made,) = recipes(StudyOrder(quick=True), ["tradeoff"])
    made.compute(SILENT)
    (pair,) = pairs
    assert len(pair.foveae) == 1
    assert np.isfinite(pair.wide.truth_z_m).mean() > 0.5


def test_the_study_of_trained_networks_needs_torch_and_is_no_part_of_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (made,) = recipes(StudyOrder(quick=True), ["learned"])
    assert {"random_scenes.py", "rendered_looks.py"} < {path.name for path in made.files}
    monkeypatch.setattr(trained_networks, "find_spec", lambda _name: None)
    with pytest.raises(InvalidInput, match=r"torch, which is not installed; .*foveacam-duo\[learn\]"):
        made.compute(SILENT)
    asked: list[str] = []

    def none_of(_order: StudyOrder, names: Sequence[str]) -> list[StudyRecipe]:
        asked.extend(names)
        return []

    monkeypatch.setattr(study_recipes, "recipes", none_of)
    monkeypatch.setattr("sys.argv", ["foveacam", "study", "all", "--json"])
    with pytest.raises(SystemExit):
        cli.main()
    assert "standoff" in asked and "learned" not in asked


def test_vkitti_and_clusters_are_for_their_own_studies() -> None:
    with pytest.raises(InvalidInput, match="tradeoff"):
        recipes(StudyOrder(vkitti=Path("x")), ["depth"])


def test_the_wide_pairs_truth_is_that_of_its_pictures() -> None:
    warm_up()
    calibration = load_calibration(CERTIFICATE)
    with open_simulated(SCENE, inline=True) as rig:
        assert rig.truth is not None
        stand = pose_setter(rig.truth.world.animated_scene)

        def aside(x_m: float) -> None:
            stand(AgentPose(x_m=x_m, y_m=0.0))
            rig.clock.sleep_until_ns(rig.clock.now_ns() + 300_000_000)

        pair = wide_pair(rig, calibration, aside, name="here")
    left, right = (image.astype(np.float32) for image in (pair.left, pair.right))
    y, x = np.mgrid[: left.shape[0], : left.shape[1]].astype(np.float32)
    disparity_px = np.nan_to_num(pair.f_px * pair.baseline_m / pair.truth_z_m).astype(np.float32)
    counted = pair.seen & np.isfinite(pair.truth_z_m)
    assert 0.6 < counted.mean() < 1.0

    def differ(off_x_px: float, off_y_px: float) -> float:
        moved = cv2.remap(right, x - disparity_px + off_x_px, y + off_y_px, cv2.INTER_LINEAR)
        return float(np.abs(moved - left)[counted].mean())

    there = differ(0.0, 0.0)
    for off in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        assert there < 0.7 * differ(*off)


@pytest.mark.usefixtures("without_benches")
def test_the_pairs_of_the_learned_study_are_rendered_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trained_networks, "PAIR_WORKERS", 1)
    folder = trained_networks.rendered_pairs(tmp_path, Split.HELD_OUT, 1, SILENT)
    before = (folder / DOCUMENT).stat().st_mtime_ns
    assert len(StoredPairs(folder)) == 1
    assert trained_networks.rendered_pairs(tmp_path, Split.HELD_OUT, 1, SILENT) == folder
    assert (folder / DOCUMENT).stat().st_mtime_ns == before
