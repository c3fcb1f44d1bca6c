// The tools of the views derived from both eyes: the anaglyph's colours, and what computes the depth.

import { anaglyphColours } from "./anaglyph_colours.js";
import { depthBackend } from "./depth_backend.js";

/** @param {import("./views.js").Views} views @param {import("#console").Commands} commands */
export function equipDerived(views, commands) {
  views.pane("anaglyph").tools.prepend(anaglyphColours(commands));
  views.pane("depth").tools.prepend(depthBackend(commands));
}
