"""Checks what `foveacam look` is asked for; prints the answer and writes the file of its shape."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Self

import typer

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.storage.disk import disk_errors, write_file
from foveacam_server.foundation.plain_words import validated
from foveacam_server.resources.looking.clouds.collection import ShapeFile
from foveacam_server.resources.looking.fixations.answer_words import AnyFixation, answer_lines
from foveacam_server.resources.looking.fixations.schema import FixationRequest

_FILES: Mapping[str, ShapeFile] = MappingProxyType(
    {".ply": "cloud.ply", ".glb": "mesh.glb", ".png": "depth.png"}
)
_WITH_SHAPE = ("both_foveae", "surroundings")
"""Bases of answers whose last look shows the place to both foveae, so that it has a shape."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LookOrder:
    """The look to make; `save`: the file to write its shape to."""

    request: FixationRequest
    save: Path | None

    @classmethod
    def checked(cls, x_px: float, y_px: float, *, save: Path | None) -> Self:
        """Return the order of the command's words; raise `InvalidInput` for invalid ones."""
        if save is not None and save.suffix.lower() not in _FILES:
            raise InvalidInput(
                f"--save {save}: a shape is written as .ply (points), .glb (textured surface) or .png (depth"
                " as a picture); end the name in one of these"
            )
        if save is not None and not save.parent.is_dir():
            raise InvalidInput(f"--save {save}: there is no folder {save.parent}; make it, or choose another")
        pixel = {"x_px": x_px, "y_px": y_px}
        given = {"pixel": pixel, "depth": save is not None}
        return cls(request=validated(FixationRequest, given), save=save)

    @property
    def file(self) -> ShapeFile:
        """The file of a cloud that `save` gets."""
        return "cloud.ply" if self.save is None else _FILES[self.save.suffix.lower()]

    @property
    def place(self) -> str:
        """The place as in messages."""
        pixel = self.request.pixel
        return "" if pixel is None else f"({pixel.x_px:g}, {pixel.y_px:g})"


def print_answer(order: LookOrder, fixation: AnyFixation, *, as_json: bool) -> None:
    """Print the answer; raise `FoveaError` for one without a distance and without limits."""
    if as_json:
        typer.echo(json.dumps(fixation.model_dump(mode="json", exclude_unset=True)))
    if fixation.basis is None:
        raise FoveaError(
            f"look at {order.place}: no distance was found ({fixation.state.replace('_', ' ')}):"
            f" {fixation.reason}"
        )
    if not as_json:
        for line in answer_lines(fixation):
            typer.echo(line)


def save_shape(
    order: LookOrder, fixation: AnyFixation, content: Callable[[], bytes], *, as_json: bool
) -> None:
    """Write the shape's file, if one was asked for; raise `FoveaError` where the answer has no shape."""
    path = order.save
    if path is None:
        return
    if fixation.basis not in _WITH_SHAPE or fixation.state == "out_of_range":
        raise FoveaError(
            f"--save {path}: not both foveae show the place {order.place}, so it has no shape; nothing was"
            " written; look at a place that both show"
        )
    found = content()
    with disk_errors(f"the file {path.name}", path.parent):
        write_file(path, found)
    if not as_json:
        typer.echo(f"{path}: {len(found) / 1e6:.1f} MB")
