"""Take a still for the command line: with the command's own rig, or on a running server."""

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import typer
from pydantic import SecretStr
from rich.console import Console

from foveacam_hardware.contract import FoveaError, Frame, InvalidInput, Role
from foveacam_pipeline.capture.dataset import ImageCodec
from foveacam_pipeline.capture.still import StillKeep, StillLabels, StillPlan, take_still, write_still
from foveacam_pipeline.workers.progress import SilentProgress
from foveacam_server.commands.options import RigOptions
from foveacam_server.commands.server_rig import server_rig
from foveacam_server.foundation.names import new_id
from foveacam_server.foundation.plain_words import validated
from foveacam_server.resources.capturing.stills.collection import STILLS, StillCollection
from foveacam_server.resources.capturing.stills.schema import StillDocument, StillRequest

if TYPE_CHECKING:
    from foveacam_client import models

WAIT_S = 60.0


def take_on_server(server: str, request: StillRequest, *, token: SecretStr | None) -> "models.StillDocument":
    """Take a still on a server and return it; raise the server's problem as an error."""
    from foveacam_client import models

    order = models.StillRequest.model_validate(request.as_json())
    with server_rig(server, token=token) as rig:
        return rig.wait(rig.api.stills.create(order), timeout_s=WAIT_S)


@dataclass(frozen=True, slots=True, kw_only=True)
class StillOrder:
    """The still to take."""

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
        """Return the order of the options; raise `InvalidInput` or `OutOfRange` for invalid ones."""
        keep = StillKeep.ALL if every_frame else StillKeep.MEAN
        unknown = [each for each in cameras or [] if each not in tuple(Role)]
        if unknown:
            raise InvalidInput(
                f"--camera {unknown[0]}: the cameras are wide, left and right; choose of these"
            )
        roles = tuple(Role(each) for each in cameras) if cameras else tuple(Role)
        try:
            images = ImageCodec(codec)
        except ValueError as error:
            raise InvalidInput(f"--codec {codec}: images are kept as png or tiff; choose one") from error
        plan = StillPlan(frames=frames, keep=keep, roles=roles)
        return cls(plan=plan, name=name, label=label, codec=images)

    def request(self) -> StillRequest:
        """Return this order as a request to a server; raise `InvalidInput` for an invalid name or label."""
        given = {
            "stack_frames": self.plan.frames,
            "stack_keep": self.plan.keep.value,
            "cameras": [role.value for role in self.plan.roles],
            "name": self.name,
            "label": self.label,
            "codec": self.codec.value,
            "save": True,
        }
        return validated(StillRequest, given)


class _SilentWatcher(SilentProgress):
    """Implements the pipeline's `StillWatcher`: shows nothing; Ctrl-C ends the program."""

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        """Ignore it."""


def run_order(rig_options: RigOptions, order: StillOrder, *, server: str | None) -> None:
    """Take and print a still; when a camera stalls, store the other frames and raise its error."""
    if server is not None:
        found = take_on_server(server, order.request(), token=rig_options.settings.token)
        _print_still(found, as_json=rig_options.as_json)
        return
    taken, fault = _take_on_own_rig(rig_options, order)
    _print_still(taken, as_json=rig_options.as_json)
    if fault is not None:
        raise fault


def _take_on_own_rig(rig_options: RigOptions, order: StillOrder) -> tuple[StillDocument, FoveaError | None]:
    from foveacam_server.commands.calibration_data import (
        open_data,  # imports SciPy and the database, not needed with --server
    )
    from foveacam_server.commands.rig import OwnRig, RigChoice, open_enabled_rig

    choice, console = RigChoice.of(rig_options), Console(stderr=True, quiet=rig_options.as_json)
    with open_data(choice, lock=False) as data:
        stills, still_id = StillCollection(choice.settings.data / STILLS), new_id("still")
        folder = stills.new_folder(order.name, waits=False)
        with open_enabled_rig(choice, data.settle_times, console=console) as rig:
            still = take_still(OwnRig(rig), order.plan, watch=_SilentWatcher())
        labels = StillLabels(label=order.label, codec=order.codec, id=still_id)
        write_still(folder, still, data.calibration.current, labels)
        found = stills.keep(still_id)
        return StillDocument.of(found), still.missing_error(
            kept=f"the frames so far are in {found.stored.folder}"
        )


def _print_still(still: "StillDocument | models.StillDocument", *, as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(still.model_dump(mode="json", exclude_unset=True)))
        return
    cameras = ", ".join(f"{each.camera} {each.came} of {each.asked}" for each in still.cameras)
    typer.echo(f"{still.folder}: {cameras} frames, {still.size_bytes / 1e6:.1f} MB")
