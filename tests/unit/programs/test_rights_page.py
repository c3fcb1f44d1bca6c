"""What the routes declare: the rights of the table in server/OPERATING.md, and the lease that they need."""

import asyncio
import inspect
import re
from collections.abc import Callable
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from foveacam_hardware.contract import Busy
from foveacam_server.accounts.route_rights import RouteTable, declared_access
from foveacam_server.app import API, create_app
from foveacam_server.foundation.settings import Settings

PAGE = Path(__file__).parents[3] / "server" / "OPERATING.md"
OPERATION = re.compile(r"`(DELETE|POST) (/[^`]+)`")


@pytest.fixture(scope="module")
def routes() -> RouteTable:
    return RouteTable(create_app(Settings(viewer=False)).routes)


def written_rights() -> dict[tuple[str, str], str]:
    """Return the right of each operation in the page's table."""
    table = PAGE.read_text(encoding="utf-8").partition("| what deletes |")[2].partition("\n\n")[0]
    found = {}
    for row in table.splitlines():
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        for operation in OPERATION.findall(cells[0]):
            assert operation not in found
            found[operation] = cells[-1]
    return found


def test_the_page_lists_every_operation_that_deletes_with_its_right(routes: RouteTable) -> None:
    declared = {}
    for route in routes.contexts:
        path, access = (route.path or "").removeprefix(API), declared_access(route.endpoint)
        for method in route.methods or ():
            if method == "DELETE" or (method, path) == ("POST", "/retention"):
                assert access is not None and access.right is not None
                declared[method, path] = access.right.value
    assert written_rights() == declared


class OfAnother:
    """A lease that somebody else holds."""

    def check(self, token: str | None) -> None:
        raise Busy(f"Ada holds the control lease, not {token}")

    def require(self, token: str | None, *, asked: str) -> None:
        self.check(token)


def test_every_operation_that_takes_the_lease_asks_for_it_before_it_touches_anything(
    routes: RouteTable,
) -> None:
    refused = set()
    for route in routes.contexts:
        path, endpoint = (route.path or "").removeprefix(API), route.endpoint
        if endpoint is None or "x_lease" not in inspect.signature(endpoint).parameters:
            continue
        services: dict[str, object] = {name: MagicMock() for name in inspect.signature(endpoint).parameters}
        if not path.startswith("/lease"):  # operations of the lease itself
            with pytest.raises(Busy, match="not mine"):
                answered(endpoint, services | {"lease": OfAnother(), "x_lease": "mine"})
            refused.add(path)
    assert {"/mirrors/volts", "/mirrors/steer", "/pan_tilt/moves", "/rail/moves", "/loop"} <= refused


def answered(endpoint: Callable[..., object], arguments: dict[str, object]) -> None:
    async def answer() -> None:
        found = endpoint(**arguments)
        if inspect.isawaitable(found):
            await found

    asyncio.run(answer())
