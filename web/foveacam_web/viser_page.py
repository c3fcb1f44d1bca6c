"""viser's client page as we serve it: the wheel's own file with two lines added.

The server relays its WebSocket; that the page and viser's server are of one version follows from one wheel.
"""

from functools import cache
from pathlib import Path

import viser

# viser reconnects only while its document has the focus, which a frame inside the console never has
_RECONNECT = "<script>document.hasFocus = () => true;</script>"
# No toast about software rendering
_STYLE = "<style>.mantine-Notifications-root { display: none !important; }</style>"
# Alone, the page follows the system's choice of dark or light; inside the console its address says
_THEME = """<script>{
const address = new URL(location.href);
if (!address.searchParams.has("darkMode") && matchMedia("(prefers-color-scheme: dark)").matches) {
  address.searchParams.set("darkMode", "");
  history.replaceState(null, "", address);
}}</script>"""
# Inside the console: no docked views beside the console's own, the panel folded away until it is wanted,
# and no bottom sheet, which would cover most of a pane as small as a phone's
_BARE = """<style>
[data-dock-region="left"] { display: none !important; }
[data-dock-root] > :first-child { inset: 0 !important; }
.mantine-Paper-root[style*="max-height: 60%"] { display: none !important; }
</style>
<script>{
const parts = [
  '[data-dock-region-collapse="left"]',
  '[data-testid="floating-panel"] [data-dock-minimize][aria-expanded="true"]',
];
const folded = new Set();
const fold = setInterval(() => {
  for (const part of parts) {
    const button = document.querySelector(part);
    if (button) {
      button.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true }));
      folded.add(part);
    } else if (folded.size === parts.length) {
      clearInterval(fold);
      document.activeElement?.blur();
    }
  }
}, 400);
// From the first touch on, the layout is the operator's
addEventListener("pointerdown", () => clearInterval(fold), { once: true, capture: true });
}</script>"""


class PageChanged(RuntimeError):
    """The viser wheel holds no page, or one that does not look as expected."""


@cache
def viser_page(*, bare: bool = False) -> bytes:
    """Return the page; `bare` without the docked camera views, for the console that shows them itself."""
    path = Path(viser.__file__).parent / "client" / "build" / "index.html"
    try:
        page = path.read_text(encoding="utf-8")
    except OSError as error:
        raise PageChanged(f"viser {viser.__version__} has no client page at {path}: {error}") from error
    head, separator, rest = page.partition("<head>")
    if not separator:
        raise PageChanged(f"viser {viser.__version__}: its client page has no <head>")
    added = _RECONNECT + _STYLE + (_BARE if bare else _THEME)
    return (head + separator + added + rest).encode()


def viser_subprotocol() -> str:
    """Return the WebSocket subprotocol by which viser checks that client and server are of one version."""
    return f"viser-v{viser.__version__}"
