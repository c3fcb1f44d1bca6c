"""Lists the rigs of a lab with their states, read from their servers on request."""

import asyncio
import hashlib
from collections.abc import Callable, Sequence

from foveacam_hardware.contract import FoveaError
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.http.addresses import join_address, server_address
from foveacam_server.foundation.lease import Lease
from foveacam_server.resources.operating.rigs.announcements import Announcements
from foveacam_server.resources.operating.rigs.remote_rig import RemoteRig, RemoteState, ask_picture, ask_state
from foveacam_server.resources.operating.rigs.rig_list import NamedRig
from foveacam_server.resources.operating.rigs.schema import RigEntry
from foveacam_server.rig.status import RigStatus

THIS = "this"
OWN_PICTURE = "/api/v1/views/wide/snapshot.jpg?scale=2"
URL = "/api/v1/rigs"


class RigDirectory:
    """This rig, those of the list, and the announced ones."""

    def __init__(
        self,
        named: Sequence[NamedRig],
        announcements: Announcements | None,
        *,
        own: Callable[[], RigStatus],
        lease: Lease,
    ) -> None:
        self._named = tuple(_named_rig(rig) for rig in named)
        self._announcements = announcements
        self._own = own
        self._lease = lease

    def announce(self, *, port: int, tls: bool, path: str) -> None:
        """Announce this rig in the network, if configured; blocks, so not on the event loop."""
        if self._announcements is not None:
            name = self._own().name or "FoveaCam Duo"
            self._announcements.announce(name=name, port=port, tls=tls, path=path)

    async def describe(self) -> list[RigEntry]:
        """Return this rig first, then the others; one that does not answer with the reason."""
        others = await asyncio.gather(*(_entry(rig) for rig in self._others()))
        return [self._own_entry(), *others]

    async def picture(self, rig_id: str) -> bytes:
        """Return another rig's wide picture, JPEG; raise `NotFound`, or `NotConnected` with the reason."""
        rig = next((rig for rig in self._others() if rig.id == rig_id), None)
        if rig is None:
            raise NotFound(
                f"there is no rig {rig_id} on the list",
                asked=rig_id,
                found="no such rig",
                remedy=f"GET {URL} lists them",
            )
        return await ask_picture(rig)

    def _others(self) -> list[RemoteRig]:
        """Return the rigs of the list, then announced ones whose address is not in the list."""
        found = {} if self._announcements is None else self._announcements.found
        known = {rig.url for rig in self._named}
        announced = [
            RemoteRig(id=rig.key, name=rig.name, url=rig.url, announced=True)
            for rig in sorted(found.values(), key=lambda rig: rig.name)
            if rig.url not in known
        ]
        return [*self._named, *announced]

    def _own_entry(self) -> RigEntry:
        status, lease = self._own(), self._lease.describe()
        return RigEntry(
            id=THIS,
            name=status.name or "this rig",
            address="/",
            source="this",
            rig_id=status.rig_id,
            simulated=status.simulated,
            scene=status.scene,
            state=status.state.value,
            driver=lease.person or lease.holder,
            problems=[f"{problem.device}: {problem.detail}" for problem in status.problems],
            problem=None,
            remedy=None,
            picture_url=OWN_PICTURE,
        )


def _named_rig(rig: NamedRig) -> RemoteRig:
    url = join_address(server_address(str(rig.url)), "/")
    key = hashlib.sha256(f"{rig.name}\0{url}".encode()).hexdigest()[:10]
    return RemoteRig(id=key, name=rig.name, url=url, announced=False, token_file=rig.token_file)


async def _entry(rig: RemoteRig) -> RigEntry:
    found: RemoteState | None = None
    problem, remedy = None, None
    try:
        found = await ask_state(rig)
    except FoveaError as error:
        problem, remedy = error.statement, error.remedy
    return RigEntry(
        id=rig.id,
        name=rig.name,
        address=rig.url,
        source="announced" if rig.announced else "file",
        rig_id=None if found is None else found.rig_id,
        simulated=None if found is None else found.simulated,
        scene=None if found is None else found.scene,
        state=None if found is None else found.state,
        driver=None if found is None else found.driver,
        problems=[] if found is None else list(found.problems),
        problem=problem,
        remedy=remedy,
        picture_url=f"{URL}/{rig.id}/picture.jpg",
    )
