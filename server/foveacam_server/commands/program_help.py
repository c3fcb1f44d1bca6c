"""The groups in which `foveacam --help` lists the commands, and the text of an error of the command line."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

HELP_PANELS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "Run": ("serve", "doctor", "bench", "version"),
        "Look": ("look",),
        "Capture": ("capture", "still", "record", "dataset", "recording", "batch", "archive"),
        "Calibrate": ("calibrate", "board", "accept", "confirm-zero"),
        "Study": ("study", "learn", "depth"),
        "Manage": ("users", "retention", "backup", "restore"),
    }
)
"""The groups of the help in their order, and the commands of each."""


class PanelledGroup(TyperGroup):
    """The program, whose help lists the commands by `HELP_PANELS`."""

    def __init__(self, **given: Any) -> None:  # noqa: ANN401 - as of TyperGroup
        super().__init__(**given)
        names = [name for panel in HELP_PANELS.values() for name in panel]
        self.commands = {name: self.commands[name] for name in names}
        for panel, members in HELP_PANELS.items():
            for name in members:
                command = self.commands[name]
                if isinstance(command, TyperCommand | TyperGroup):
                    command.rich_help_panel = panel


def usage_error_text(error: typer.TyperException) -> str:
    """Return an error of the command line as one line: what is wrong, what was meant, which help to see."""
    similar = list(getattr(error, "possibilities", None) or ())  # the most similar first
    text = error.message if similar else error.format_message()
    text = text if text.endswith((".", "?")) else f"{text}."
    if similar:
        text += f" Did you mean {', '.join(map(repr, similar))}?"
    context = getattr(error, "ctx", None)
    return text if context is None else f"{text} See {context.command_path} --help."
