"""The program's help: groups of commands, -h everywhere, the version, suggestions, completion."""

import re
from collections.abc import Iterator

import pytest
import typer
from typer.core import TyperGroup

from foveacam_server import __version__, cli
from foveacam_server.commands.program_help import HELP_PANELS


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """Run the program and return its exit status."""
    monkeypatch.setattr("sys.argv", ["foveacam", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert isinstance(ended.value.code, int)
    return ended.value.code


def every_command(group: TyperGroup, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Yield the words of every command and group of commands, the program itself first."""
    yield path
    for name, command in group.commands.items():
        if isinstance(command, TyperGroup):
            yield from every_command(command, (*path, name))
        else:
            yield (*path, name)


def program() -> TyperGroup:
    found = typer.main.get_command(cli.app)
    assert isinstance(found, TyperGroup)
    return found


def test_every_command_has_its_group_in_the_help_and_serve_is_first(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, "--help") == 0
    shown = capsys.readouterr().out
    titles = re.findall(r"^╭─ (\w+) ─", shown, re.MULTILINE)
    assert titles == ["Options", "Run", "Look", "Capture", "Calibrate", "Study", "Manage"]
    listed = [name for names in HELP_PANELS.values() for name in names]
    assert sorted(listed) == sorted(program().commands)
    rows = re.findall(r"^│ ([a-z-]+) ", shown[shown.index("╭─ Run") :], re.MULTILINE)
    assert rows == listed
    assert rows[0] == "serve"


def test_h_is_help_at_every_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for words in every_command(program()):
        assert run(monkeypatch, *words, "-h") == 0, words
        short = capsys.readouterr().out
        assert run(monkeypatch, *words, "--help") == 0, words
        assert capsys.readouterr().out == short
        assert "Usage: foveacam" in short


@pytest.mark.parametrize("words", [("--version",), ("-V",), ("version",)])
def test_the_version_is_printed_by_option_and_by_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: tuple[str, ...]
) -> None:
    assert run(monkeypatch, *words) == 0
    assert capsys.readouterr().out.strip() == __version__


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("captur",), "No such command 'captur'. Did you mean 'capture'? See foveacam --help."),
        (("calibrate", "widde"), "No such command 'widde'. Did you mean 'wide'? See foveacam calibrate"),
        (("capture", "--nme", "x"), "No such option: --nme. Did you mean '--name'"),
        (("serve", "--prot", "1"), "No such option: --prot. Did you mean '--port'"),
        (("zzz",), "No such command 'zzz'. See foveacam --help."),
        (("still", "--zzz"), "No such option: --zzz. See foveacam still --help."),
        (("look", "720"), "Missing argument 'Y'. See foveacam look --help."),
        (
            ("serve", "--port", "99999"),
            "Invalid value for '--port': Input should be less than or equal to 65535",
        ),
    ],
)
def test_a_command_line_that_is_wrong_is_one_line_that_suggests_what_was_meant(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], told: str
) -> None:
    assert run(monkeypatch, *words) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("foveacam: ")
    assert captured.err.count("\n") == 1
    assert told in captured.err


@pytest.mark.parametrize("words", [(), ("calibrate",)])
def test_without_a_command_the_help_is_printed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: tuple[str, ...]
) -> None:
    assert run(monkeypatch, *words) == 2
    captured = capsys.readouterr()
    assert "Usage: foveacam" in captured.out
    assert captured.err == ""


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        (("foveacam", "ca"), {"calibrate", "capture"}),
        (("foveacam", "look", "--sa"), {"--save"}),
        (("foveacam", "dataset", "che"), {"check"}),
    ],
)
def test_a_shell_completes_commands_and_options(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    typed: tuple[str, ...],
    offered: set[str],
) -> None:
    monkeypatch.setenv("_FOVEACAM_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", " ".join(typed))
    monkeypatch.setenv("COMP_CWORD", str(len(typed) - 1))
    run(monkeypatch)
    assert set(capsys.readouterr().out.split()) == offered
