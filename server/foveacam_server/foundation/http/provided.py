"""Services of the running server by type: `fixations: Provided[FixationService]` is a route's parameter."""

import functools
from collections.abc import Awaitable, Callable, Mapping
from inspect import Parameter, signature
from typing import TYPE_CHECKING, Annotated, TypeAlias, TypeVar, cast, get_type_hints

from fastapi import Depends
from starlette.requests import HTTPConnection

from foveacam_hardware.contract import DeviceFault

T = TypeVar("T")

_asked: set[object] = set()
"""The types for which the routes of all imported modules ask."""


class ServiceRegistry:
    """The opened services, each under the types for which routes ask: its class, or a Protocol of theirs."""

    def __init__(self, services: Mapping[object, object] | None = None) -> None:
        self._services = dict(services or {})

    def add(self, kind: type[T], service: T) -> None:
        """Let routes that ask for `kind` find this service."""
        self._services[kind] = service

    def open(self, kind: type[object]) -> None:
        """Make a service of what its constructor asks for by type; arguments with a default keep it."""
        kinds = get_type_hints(kind.__init__)
        asked = [one.name for one in signature(kind).parameters.values() if one.default is Parameter.empty]
        self._services[kind] = kind(**{name: self._services[kinds[name]] for name in asked})

    def get(self, kind: type[T]) -> T:
        """Return the service of a type."""
        return cast(T, self._services[kind])

    def check(self) -> None:
        """Raise `DeviceFault` when a route asks for a type that no service has."""
        missing = sorted(_name(kind) for kind in _asked - self._services.keys())
        if missing:
            raise DeviceFault(
                f"routes ask for services that were not opened: {', '.join(missing)}; open them in"
                " foveacam_server/assembly"
            )


if TYPE_CHECKING:
    Provided: TypeAlias = Annotated[T, "a service of the running server"]
else:

    class Provided:
        """`Provided[T]` annotates a route's parameter as the opened service of type T."""

        def __class_getitem__(cls, kind: object) -> object:
            _asked.add(kind)
            return Annotated[kind, Depends(_finder(kind))]


@functools.cache
def _finder(kind: type[object]) -> Callable[[HTTPConnection], Awaitable[object]]:
    """Return a dependency of requests and WebSockets; the same for every parameter of a type."""

    async def find(connection: HTTPConnection) -> object:
        registry: ServiceRegistry = connection.app.state.provided
        return registry.get(kind)

    return find


def _name(kind: object) -> str:
    return getattr(kind, "__qualname__", str(kind))
