"""Connections of its own to a server, for objects that read more from it after the rig was closed."""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from foveacam_client.connection import Connection
from foveacam_client.problems import ClientError
from foveacam_client.retries import RetryPolicy

if TYPE_CHECKING:
    from foveacam_client.generated.rig import Rig

_RETRIES = RetryPolicy(attempts=2, reconnect_s=5.0, opening_s=0.0)
"""A server that has ended is reported soon."""


@dataclass(frozen=True, slots=True)
class ServerSource:
    """A server to read from. It is pickled without the connection, which has the token."""

    connection: Connection | None = field(default=None, repr=False)

    def open_rig(self) -> "Rig":
        """Return a rig with a connection of its own; close it, or use it as a context."""
        from foveacam_client.generated.rig import Rig  # here, since the rig's module imports this one

        if self.connection is None:
            raise ClientError(
                "asked for more than this object holds, and it has no server (it was made from a file, or"
                " unpickled); connect to the server and ask for it there by its id"
            )
        return Rig(replace(self.connection, retries=_RETRIES))

    def __reduce__(self) -> tuple[type["ServerSource"], tuple[()]]:
        return ServerSource, ()
