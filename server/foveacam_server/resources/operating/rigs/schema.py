"""Schemas of the list of rigs."""

from typing import Literal

from foveacam_server.foundation.schema import ResponseModel

Source = Literal["this", "file", "announced"]


class RigEntry(ResponseModel):
    """One rig of the list, with the state that its server reports now.

    `state`: null where it does not answer; `problem` then gives the reason. `driver`: who holds its lease.
    `picture_url`: its newest wide picture, read through this server.
    """

    id: str
    name: str
    address: str
    source: Source
    rig_id: str | None
    simulated: bool | None
    scene: str | None
    state: str | None
    driver: str | None
    problems: list[str]
    problem: str | None
    remedy: str | None
    picture_url: str
