"""Takes a still for the command line: with a rig opened here, or by the server that has it."""

import json
from dataclasses import dataclass
from typing import Self

import typer
from rich.console import Console

from foveacam_hardware.contract import FoveaError, Frame, InvalidInput, Role
from foveacam_pipeline.capture.dataset import ImageCodec
from foveacam_pipeline.capture.still import StillKeep, StillLabels, StillPlan, take_still, write_still
from foveacam_server.calibrate_command.choices import CalibrateOptions
from foveacam_server.calibrate_command.rig import RigChoice, opened_rig, opened_shop
from foveacam_server.capture_command.run import OwnRig
from foveacam_server.capturing.still_collection import STILLS, StillCollection
from foveacam_server.capturing.still_documents import still_document
from foveacam_server.runtime.names import new_id
from foveacam_server.runtime.store import Document
from foveacam_server.still_command.remote import pressed


@dataclass(frozen=True, slots=True, kw_only=True)
class StillOrder:
    """What was asked for."""

    plan: StillPlan
    name: str | None
    label: str
    codec: ImageCodec

    @classmethod
    def checked(
        cls,
        *,
        name: str | None,
        frames: int,
        every_frame: bool,
        cameras: list[str] | None,
        label: str,
        codec: str,
    ) -> Self:
        """Return what the options mean; raise InvalidInput or OutOfRange for what they cannot."""
        keep = StillKeep.ALL if every_frame else StillKeep.MEAN
        strange = [each for each in cameras or [] if each not in tuple(Role)]
        if strange:
            raise InvalidInput(
                f"--camera {strange[0]}: the cameras are wide, left and right; choose of these"
            )
        roles = tuple(Role(each) for each in cameras) if cameras else tuple(Role)
        try:
            images = ImageCodec(codec)
        except ValueError as error:
            raise InvalidInput(f"--codec {codec}: images are kept as png or tiff; choose one") from error
        plan = StillPlan(frames=frames, keep=keep, roles=roles)
        return cls(plan=plan, name=name, label=label, codec=images)

    def request(self) -> Document:
        """Return the body of the same order to a server."""
        return {
            "stack_frames": self.plan.frames,
            "stack_keep": self.plan.keep.value,
            "cameras": [role.value for role in self.plan.roles],
            "name": self.name,
            "label": self.label,
            "codec": self.codec.value,
            "save": True,
        }


class _Blind:
    """Implements the pipeline's `StillWatcher`: it looks away, and Ctrl-C ends the program."""

    def progress(self, done: int, *, total: int, note: str) -> None:
        """Look away."""

    def cancelled(self) -> bool:
        """Go on."""
        return False

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        """Look away."""


def run_order(wish: CalibrateOptions, order: StillOrder, *, server: str | None) -> None:
    """Take the still and print what came; where a camera stalled, keep the rest and raise its error."""
    if server is not None:
        _show(pressed(server, order.request(), token=wish.settings.token), as_json=wish.as_json)
        return
    document, trouble = _taken(RigChoice.of(wish), order, console=Console(stderr=True, quiet=wish.as_json))
    _show(document, as_json=wish.as_json)
    if trouble is not None:
        raise trouble


def _taken(choice: RigChoice, order: StillOrder, *, console: Console) -> tuple[Document, FoveaError | None]:
    with opened_shop(choice) as shop:
        shelf, still_id = StillCollection(choice.settings.data / STILLS), new_id("still")
        folder = shelf.new_folder(order.name, waits=False)
        with opened_rig(choice, shop.settle_times, console=console) as rig:
            still = take_still(OwnRig(rig), order.plan, watch=_Blind())
        labels = StillLabels(label=order.label, codec=order.codec, id=still_id)
        write_still(folder, still, shop.calibration.current, labels)
        found = shelf.keep(still_id)
        return still_document(found), still.missing_error(kept=f"what came is kept in {found.kept.folder}")


def _show(document: Document, *, as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(document))
        return
    cameras = ", ".join(f"{each['camera']} {each['came']} of {each['asked']}" for each in document["cameras"])
    typer.echo(f"{document['folder']}: {cameras} frames, {document['size_bytes'] / 1e6:.1f} MB")
