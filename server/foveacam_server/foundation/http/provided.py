"""Services of the running server by type: `fixations: Provided[FixationService]` is a route's parameter."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from inspect import Parameter, signature
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar, cast, get_type_hints

from fastapi import Depends
from fastapi.params import Depends as Dependency
from starlette.requests import HTTPConnection

from foveacam_hardware.contract import DeviceFault

T = TypeVar("T")


class ServiceRegistry:
    """Registry of the opened services by type: the class, or a Protocol that routes declare."""

    def __init__(self, services: Mapping[object, object] | None = None) -> None:
        self._services = dict(services or {})

    def add(self, kind: type[T], service: T) -> None:
        """Register a service under the type `kind`."""
        self._services[kind] = service

    def open(self, kind: type[object]) -> None:
        """Construct a service from registered ones by its parameters' types; defaults are kept."""
        kinds = get_type_hints(kind.__init__)
        asked = [one.name for one in signature(kind).parameters.values() if one.default is Parameter.empty]
        self._services[kind] = kind(**{name: self._services[kinds[name]] for name in asked})

    def get(self, kind: type[T]) -> T:
        """Return the service of a type."""
        return cast(T, self._services[kind])

    def check(self, endpoint: Callable[..., Any]) -> None:  # Any: a route's own arguments and answer
        """Raise `DeviceFault` when a route requires a type without a registered service."""
        missing = [_name(kind) for kind in asked_by(endpoint) if kind not in self._services]
        if missing:
            raise DeviceFault(
                f"route {endpoint.__module__}.{endpoint.__qualname__} asks for services that were not opened:"
                f" {', '.join(missing)}; open them in foveacam_server/assembly, or by `opens` of its router"
            )


@dataclass(frozen=True, slots=True)
class _Finder:
    """A dependency of requests and WebSockets; equal for all parameters of one type."""

    kind: Any  # a type, or a union of types

    async def __call__(self, connection: HTTPConnection) -> object:
        registry: ServiceRegistry = connection.app.state.provided
        return registry.get(self.kind)


if TYPE_CHECKING:
    Provided: TypeAlias = Annotated[T, "a service of the running server"]
else:

    class Provided:
        """`Provided[T]` annotates a route's parameter as the opened service of type T."""

        def __class_getitem__(cls, kind: object) -> object:
            return Annotated[kind, Depends(_Finder(kind))]


def asked_by(endpoint: Callable[..., Any]) -> Iterator[object]:  # Any: a route's own arguments and answer
    """Yield the types that a route's parameters require."""
    for parameter in signature(endpoint).parameters.values():
        for note in getattr(parameter.annotation, "__metadata__", ()):
            if isinstance(note, Dependency) and isinstance(note.dependency, _Finder):
                yield note.dependency.kind


def _name(kind: object) -> str:
    return getattr(kind, "__qualname__", str(kind))
