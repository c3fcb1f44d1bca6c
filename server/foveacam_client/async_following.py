"""A target that the rig follows, until it is stopped.

`generated/following.py` is this module without `await`.
"""

from contextlib import suppress
from types import TracebackType
from typing import Self

from foveacam_client.generated import models
from foveacam_client.generated.async_operations import AsyncOperations
from foveacam_client.measured import distance_text, shortened
from foveacam_client.problems import NotFound


class AsyncFollowing:
    """A followed target; use it as a context, or call `stop`. `newest`: its state when last read."""

    def __init__(self, api: AsyncOperations, newest: models.FollowedDocument) -> None:
        self._api = api
        self.newest = newest

    @property
    def id(self) -> str:
        """The id of the followed target."""
        return self.newest.id

    async def read(self) -> models.FollowedDocument:
        """Return the target as it is now: state, place, distance with its standard error, speed."""
        self.newest = await self._api.follows.get(self.id)
        return self.newest

    async def trail(self) -> list[models.TrailPoint]:
        """Return where the target was at its last hits, 600 at most, oldest first."""
        return await self._api.follows.trail(self.id)

    async def stop(self) -> None:
        """Stop following the target; no effect where that has ended already."""
        with suppress(NotFound):  # ended by someone else, or by the stop button
            await self._api.follows.end(self.id)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.stop()

    def __repr__(self) -> str:
        found = self.newest
        distance = distance_text(found.distance_m, found.distance_sigma_m)
        return (
            f"{type(self).__name__}(id={found.id!r}, {shortened(found.label)!r}, {found.state}, {distance})"
        )
