"""Routes of the named layouts of windows that show several views."""

from typing import Annotated

from fastapi import Path
from pydantic import Field

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.named_documents import GivenName, NamedDocument, NamedDocuments
from foveacam_server.foundation.schema import RequestModel

router = GuardedRouter("/views/layouts", tags=["views"], reading=Right.VIEW, changing=Right.OPERATE)


class WindowLayout(NamedDocument):
    """A named layout of `/windows`; `layout`: the fragment (after #) of its address."""

    layout: str


class WindowLayoutRequest(RequestModel):
    """A layout in the form of its address: `row-600(wide,column-500(left,right))`."""

    layout: Annotated[str, Field(min_length=1, max_length=600, pattern=r"^[a-z_0-9(),-]+$")]


NamePath = Annotated[GivenName, Path()]


@router.get("", summary="Named layouts of windows")
def every(window_layouts: Provided[NamedDocuments[WindowLayout]]) -> list[WindowLayout]:
    """Return all layouts by their names."""
    return window_layouts.every()


@router.put("/{name}", summary="Save a layout", responses=problems(507))
def save(
    name: NamePath, request: WindowLayoutRequest, window_layouts: Provided[NamedDocuments[WindowLayout]]
) -> WindowLayout:
    """Save a layout, over one of the same name."""
    saved = WindowLayout(name=name, layout=request.layout)
    window_layouts.put(saved)
    return saved


@router.delete("/{name}", status_code=204, summary="Delete a layout", responses=problems(404, 507))
def delete(name: NamePath, window_layouts: Provided[NamedDocuments[WindowLayout]]) -> None:
    """Delete a layout; windows that show it stay."""
    window_layouts.delete(name)
