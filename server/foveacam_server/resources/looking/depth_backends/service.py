"""Computes the disparities of looks by the chosen backend; falls back to semi-global matching."""

import logging
import threading
from pathlib import Path
from typing import Final

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.networks.card import StereoNetwork, shipped_network
from foveacam_pipeline.networks.check import NetworkCheck, check_network
from foveacam_pipeline.networks.estimator import NetworkEstimator
from foveacam_pipeline.networks.session import missing_runtime
from foveacam_pipeline.stereo.estimator import BACKENDS, DepthEstimator, MatchedPair
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.whole_file import read_document, write_document
from foveacam_server.resources.looking.depth_backends.networks import NetworkFolder
from foveacam_server.resources.looking.depth_backends.schema import (
    DepthBackendChange,
    DepthBackendChoice,
    DepthBackendDocument,
    DepthBackendsDocument,
    StoredChoice,
)

_log = logging.getLogger(__name__)
BUILT_IN: Final = "sgbm"
FORM, VERSION = "foveacam-depth-backend", 1


class DepthBackendService:
    """Depth backends and the choice among them, which survives a restart; callable from any thread."""

    def __init__(self, folder: Path, *, events: EventLog) -> None:
        self.networks = NetworkFolder(folder)
        self._choice_file = folder / "in_use.json"
        self._events = events
        self._changing = threading.Lock()
        self._in_use: DepthEstimator = BACKENDS[BUILT_IN]
        self._sha256: str | None = None
        self._fallback: str | None = None
        self.last_pair: RectifiedPair | None = None
        """The newest look whose depth was computed."""
        self._restore()

    def estimate(self, pair: RectifiedPair) -> MatchedPair:
        """Return the disparities of a look by the chosen backend; when it fails, by semi-global matching."""
        self.last_pair = pair
        return self.estimate_live(pair)

    def estimate_live(self, pair: RectifiedPair) -> MatchedPair:
        """Return the disparities of a pair as `estimate` does, without keeping it as the newest look."""
        with self._changing:
            backend, sha256 = self._in_use, self._sha256
        try:
            matched = MatchedPair(disparity=backend.estimate(pair), backend=backend.name, sha256=sha256)
        except FoveaError as error:
            if sha256 is None:
                raise
            self._emit_fallback(backend.name, str(error))
            matched = MatchedPair(disparity=BACKENDS[BUILT_IN].estimate(pair), backend=BUILT_IN, sha256=None)
        else:
            self._fallback = None
        return matched

    def describe(self) -> DepthBackendsDocument:
        """Return all backends and the one in use."""
        built_in = [_describe_built_in(name) for name in BACKENDS]
        shipped = shipped_network()
        networks = [(shipped.name, shipped), *self.networks.every().items()]
        return DepthBackendsDocument(
            in_use=self._in_use.name,
            fallback=self._fallback,
            backends=[*built_in, *(_describe(name, network) for name, network in networks)],
        )

    def choose(self, choice: DepthBackendChoice) -> DepthBackendsDocument:
        """Use a backend from now on; raise InvalidInput when it cannot be used or needs a confirmation."""
        estimator, sha256 = self.open(choice.name, research_confirmed=choice.research_confirmed)
        write_document(
            self._choice_file,
            {"format": FORM, "version": VERSION, **StoredChoice(name=choice.name).model_dump()},
            what="the choice of the depth backend",
        )
        self._use(estimator, sha256)
        self._events.emit(
            "depth.backend",
            f"depth of looks is computed by {choice.name}",
            data=DepthBackendChange(name=choice.name, detail="chosen"),
        )
        return self.describe()

    def network_in_use(self) -> StereoNetwork | None:
        """Return the chosen network; None while a built-in backend is chosen."""
        with self._changing:
            name, sha256 = self._in_use.name, self._sha256
        return None if sha256 is None else self.networks.get(name)

    def open(self, name: str, *, research_confirmed: bool) -> tuple[DepthEstimator, str | None]:
        """Return a loaded backend and the SHA-256 of its graph.

        Raise NotFound for an unknown name, InvalidInput when it cannot be used or needs a confirmation.
        """
        for built_in, estimator in BACKENDS.items():
            if built_in == name:
                return estimator, None
        network = self.networks.get(name)
        if network.card.research_only and not research_confirmed:
            raise InvalidInput(
                f"{name} is for research only ({network.card.licence})",
                asked=name,
                found=network.card.licence,
                remedy="confirm that this is research with research_confirmed: true, or choose another",
            )
        return NetworkEstimator.open(network), network.card.sha256

    def check(self, name: str) -> NetworkCheck:
        """Check a network on a pair whose disparities are known."""
        return check_network(self.networks.get(name))

    def _use(self, estimator: DepthEstimator, sha256: str | None) -> None:
        with self._changing:
            self._in_use, self._sha256, self._fallback = estimator, sha256, None

    def _restore(self) -> None:
        """Restore the choice of before the restart; where that fails, log a warning and use `sgbm`."""
        try:
            stored = read_document(self._choice_file, StoredChoice, form=FORM, version=VERSION)
        except FileNotFoundError:
            return
        except (OSError, ValueError) as error:
            _log.warning("%s cannot be read: %s", self._choice_file, error)
            return
        if stored.name == BUILT_IN:
            return
        try:
            self._use(*self.open(stored.name, research_confirmed=True))
        except FoveaError as error:
            self._emit_fallback(stored.name, str(error))

    def _emit_fallback(self, name: str, reason: str) -> None:
        known = self._fallback == reason
        self._fallback = reason
        if not known:
            self._events.emit(
                "depth.fallback",
                f"depth by sgbm instead of {name}: {reason}",
                level=EventLevel.WARNING,
                data=DepthBackendChange(name=name, detail=reason),
            )


def _describe_built_in(name: str) -> DepthBackendDocument:
    return DepthBackendDocument(
        name=name,
        kind="built_in",
        licence="that of this program",
        research_only=False,
        sha256=None,
        problem=None,
    )


def _describe(name: str, network: StereoNetwork | str) -> DepthBackendDocument:
    if isinstance(network, str):
        return DepthBackendDocument(
            name=name, kind="network", licence="unknown", research_only=True, sha256=None, problem=network
        )
    return DepthBackendDocument(
        name=name,
        kind="network",
        licence=network.card.licence,
        research_only=network.card.research_only,
        sha256=network.card.sha256,
        problem=missing_runtime(),
    )
