"""Serves the guide for users, Markdown in the folder `guide`, as pages in the console's look.

Links among its files become links among the pages; other links lead to this server or to other sites.
"""

import re
from functools import lru_cache
from pathlib import Path

from fastapi import FastAPI
from fastapi.responses import HTMLResponse, RedirectResponse

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.console.pages import page_text
from foveacam_server.console.static_files import NO_STALE_PAGES
from foveacam_server.foundation.errors import NotFound

GUIDE = "/guide"
FOLDER = Path(__file__).parent / "guide"
NAMES = ("looking", "devices", "calibrating", "capturing", "studying", "operating")
"""Names of the pages, in the order of the navigation."""
_TO_PAGE = re.compile(r"([a-z]+)\.md(#.*)?")

router = GuardedRouter(GUIDE, include_in_schema=False, reading=Right.VIEW, changing=Right.ADMINISTER)


@router.get("")
def first_page() -> RedirectResponse:
    """Redirect to the first page of the guide."""
    return RedirectResponse(f"{GUIDE}/{NAMES[0]}", status_code=307)


@router.get("/{name}")
def guide_page(name: str) -> HTMLResponse:
    """Return one page of the guide."""
    if name not in NAMES:
        raise NotFound(
            f"the guide has no page {name!r}",
            asked=name,
            found=f"the pages {', '.join(NAMES)}",
            remedy=f"open {GUIDE}/{NAMES[0]}",
        )
    text = page_text("guide.html")
    for mark, content in (
        ("title", name.capitalize()),
        ("navigation", _navigation(name)),
        ("article", article(name)),
    ):
        text = text.replace(f"<!-- {mark} -->", content)
    return HTMLResponse(text, headers=NO_STALE_PAGES)


@lru_cache(maxsize=len(NAMES))
def article(name: str) -> str:
    """Return the HTML of one page's text."""
    from markdown_it import MarkdownIt  # a server's start has no use for it

    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = reader.parse((FOLDER / f"{name}.md").read_text(encoding="utf-8"))
    for token, following in zip(tokens, [*tokens[1:], None], strict=True):
        if token.type == "heading_open" and following is not None:
            token.attrSet("id", anchor(following.content))
        for part in token.children or ():
            if part.type == "link_open":
                part.attrs.update(_link_attributes(str(part.attrGet("href"))))
    written = str(reader.renderer.render(tokens, reader.options, {}))
    return written.replace("<pre>", '<pre tabindex="0">')  # a long line is scrolled to by keys too


def anchor(heading: str) -> str:
    """Return the anchor of a heading, made like GitHub's."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def _link_attributes(target: str) -> dict[str, str]:
    """Return the attributes of a link to a page of the guide, or to another site in a new tab."""
    found = _TO_PAGE.fullmatch(target)
    if found is not None:
        return {"href": f"{GUIDE}/{found[1]}{found[2] or ''}"}
    return {"target": "_blank", "rel": "noopener"} if target.startswith("http") else {}


def _navigation(current: str) -> str:
    marks = {current: ' aria-current="page"'}
    return "".join(f'<a href="{GUIDE}/{name}"{marks.get(name, "")}>{name.capitalize()}</a>' for name in NAMES)


def install(app: FastAPI) -> None:
    """Serve the guide."""
    app.include_router(router)
