"""Stereo networks in the data directory: one folder each, with `card.yaml` and the ONNX graph."""

import shutil
from pathlib import Path

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.networks.card import (
    SHIPPED_NAME,
    StereoNetwork,
    check_digest,
    load_network,
    shipped_network,
)
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.foundation.errors import NotFound

CARD = "card.yaml"
RESERVED = ("sgbm", "live", SHIPPED_NAME)
"""Names of the built-in backends, which an added network must not take."""


class NetworkFolder:
    """Adds, lists, finds and removes networks; used by the server and by the commands of `foveacam depth`."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def add(self, card: Path) -> StereoNetwork:
        """Copy a card, its graph and weights; raise InvalidInput for a name that is taken or reserved."""
        network = load_network(card)
        check_digest(network)
        target = self._folder / network.name
        if network.name in RESERVED or target.exists():
            raise InvalidInput(
                f"there is a depth backend {network.name} already",
                asked=network.name,
                remedy="give the card another name, or remove that one with "
                f"`foveacam depth remove {network.name}`",
            )
        partial = target.with_suffix(".part")
        with disk_errors(f"the network {network.name}", self._folder):
            shutil.rmtree(partial, ignore_errors=True)
            partial.mkdir(parents=True)
            for path in network.files:
                shutil.copyfile(path, partial / path.name)
            shutil.copyfile(card, partial / CARD)
            partial.rename(target)
        return StereoNetwork(card=network.card, path=target / CARD)

    def remove(self, name: str) -> None:
        """Delete a network and its graph; raise NotFound when there is none."""
        folder = self._existing(name)
        with disk_errors(f"the network {name}", self._folder):
            shutil.rmtree(folder)

    def get(self, name: str) -> StereoNetwork:
        """Return an added network or the shipped one.

        Raise NotFound when there is none, InvalidInput when its card cannot be read.
        """
        if name == SHIPPED_NAME:
            return shipped_network()
        return load_network(self._existing(name) / CARD)

    def every(self) -> dict[str, StereoNetwork | str]:
        """Return all added networks by name; for one that cannot be used, the reason."""
        found: dict[str, StereoNetwork | str] = {}
        for card in sorted(self._folder.glob(f"*/{CARD}")):
            name = card.parent.name
            try:
                found[name] = load_network(card)
            except FoveaError as error:
                found[name] = str(error)
            if name in RESERVED:
                found[name] = (
                    f"a backend that is built in has the name {name} too; give this one another name in its "
                    f"card and add it again, after `foveacam depth remove {name}`"
                )
        return found

    def _existing(self, name: str) -> Path:
        folder = self._folder / name
        if Path(name).name != name or not (folder / CARD).is_file():
            raise NotFound(
                f"there is no depth network {name}; `foveacam depth list` and GET /api/v1/depth/backends "
                "name those there are",
                asked=name,
            )
        return folder
