"""The table of what deletes, in server/OPERATING.md, beside what the routes declare."""

import re
from pathlib import Path

from foveacam_server.accounts.route_rights import RouteTable, declared_access
from foveacam_server.app import API, create_app
from foveacam_server.foundation.settings import Settings

PAGE = Path(__file__).parents[3] / "server" / "OPERATING.md"
OPERATION = re.compile(r"`(DELETE|POST) (/[^`]+)`")


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


def test_the_page_lists_every_operation_that_deletes_with_its_right() -> None:
    declared = {}
    for route in RouteTable(create_app(Settings(viewer=False)).routes).contexts:
        path, access = (route.path or "").removeprefix(API), declared_access(route.endpoint)
        for method in route.methods or ():
            if method == "DELETE" or (method, path) == ("POST", "/retention"):
                assert access is not None and access.right is not None
                declared[method, path] = access.right.value
    assert written_rights() == declared
