"""viser's client page as the server delivers it: the installed wheel's file with scripts and styles added."""

from functools import cache
from pathlib import Path

import viser

# viser reconnects only while its document has focus, which a frame in the console never has
_RECONNECT = "<script>document.hasFocus = () => true;</script>"
# Hides the toast about software rendering
_STYLE = "<style>.mantine-Notifications-root { display: none !important; }</style>"
# Outside the console the page follows the system's dark or light; inside, its address sets it
_THEME = """<script>{
const address = new URL(location.href);
if (!address.searchParams.has("darkMode") && matchMedia("(prefers-color-scheme: dark)").matches) {
  address.searchParams.set("darkMode", "");
  history.replaceState(null, "", address);
}}</script>"""
# viser draws everything anew once a second, changed or not. In a browser that draws in software, a few shapes
# take a core for most of that second; every five seconds is enough for a change that asked for no drawing.
# viser's attempts to reconnect, also once a second, keep their pace.
_DRAW_SELDOM = """<script>{
const every = setInterval;
window.setInterval = (run, period_ms, ...rest) =>
  every(run, period_ms === 1000 && !String(run).includes("retry") ? 5000 : period_ms, ...rest);
}</script>"""
# Outside the console nothing else on the page stops; the address holds below any path of the server
_STOP = '<script type="module" src="../static/js/looking/scene/viser_stop.js"></script>'
_PACE = Path(__file__).parent / "static" / "js" / "looking" / "scene" / "drawing_pace.js"
# Inside the console: hides the docked views, which the console itself shows, folds the panel, hides it in a
# low pane, whose picture it would cover, and hides the bottom sheet, which would cover most of a phone's pane
_BARE = """<style>
[data-dock-region="left"] { display: none !important; }
[data-dock-root] > :first-child { inset: 0 !important; }
.mantine-Paper-root[style*="max-height: 60%"] { display: none !important; }
@media (max-height: 420px) { [data-testid="floating-panel"] { display: none !important; } }
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
// The operator's first touch ends the folding
addEventListener("pointerdown", () => clearInterval(fold), { once: true, capture: true });
}</script>"""


class PageChanged(RuntimeError):
    """The viser wheel has no client page or an unexpected one."""


@cache
def viser_page(*, bare: bool = False) -> bytes:
    """Return the page as UTF-8 bytes; `bare`: without the docked camera views, for the console."""
    path = Path(viser.__file__).parent / "client" / "build" / "index.html"
    try:
        page = path.read_text(encoding="utf-8")
    except OSError as error:
        raise PageChanged(f"viser {viser.__version__} has no client page at {path}: {error}") from error
    head, separator, rest = page.partition("<head>")
    if not separator:
        raise PageChanged(f"viser {viser.__version__}: its client page has no <head>")
    added = _RECONNECT + _STYLE + (_DRAW_SELDOM + _draw_in_steps() + _BARE if bare else _THEME + _STOP)
    return (head + separator + added + rest).encode()


def _draw_in_steps() -> str:
    """Return the script that spaces out the drawings of a browser that draws in software."""
    pace = _PACE.read_text(encoding="utf-8")
    return f'<script type="module">{pace}\npaceDrawing(window);</script>'


def viser_subprotocol() -> str:
    """Return the WebSocket subprotocol with which viser checks that client and server versions agree."""
    return f"viser-v{viser.__version__}"
