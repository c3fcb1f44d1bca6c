// The graph of who feeds whom: parts in columns, lines with their rates, and the details of the part that is chosen.

import { html, svg } from "../../elements/dom.js";
import { figures, nothing } from "../../elements/parts.js";
import { BOX, layered } from "./layers.js";
import { edgeRate, partDetails, partName, partState, partWords } from "./flow_words.js";

/**
 * @import { EdgeDocument, EngineDocument, PartDocument } from "#api"
 * @import { Box, Route } from "./layers.js"
 * @typedef {{chosen: string, choose: (name: string) => void}} Choice
 */

const MARGIN = 6;
const BAR_HEIGHT = 4;

/** @param {EngineDocument} engine @param {Choice} choice */
export function graphOf(engine, { chosen, choose }) {
  const { parts, edges } = engine;
  if (edges.length === 0) return nothing("Nothing has been handed over yet.");
  const { width, height, boxes, routes } = layered(edges);
  const named = new Map(parts.map((part) => [part.name, part]));
  const part = named.get(chosen);
  const view = [-MARGIN, -MARGIN, width + 2 * MARGIN, height + 2 * MARGIN];
  return html`<div class="stack">
    <div class="scroll-x" tabindex="0" role="group" aria-label="Who feeds whom, graph">
      <svg class="flow" viewBox=${view.join(" ")} width=${view[2]} height=${view[3]} role="group" aria-label="Who feeds whom">
        ${routes.map((route) => lineOf(/** @type {EdgeDocument} */ (edges[route.line]), route, chosen))}
        ${boxes.map((box) => boxOf(box, /** @type {PartDocument} */ (named.get(box.name)), engine, { chosen, choose }))}
        ${routes.map((route) => rateOf(/** @type {EdgeDocument} */ (edges[route.line]), route))}
      </svg>
    </div>
    <div class="flow-part">
      ${part ? [html`<h4>${partName(part)}</h4>`, figures(partDetails(part, engine))] : html`<p class="note">Choose a part to see what it takes and gives.</p>`}
    </div>
  </div>`;
}

/** @param {EdgeDocument} edge @param {Route} route @param {string} chosen */
function lineOf(edge, { path }, chosen) {
  const states = [
    edge.rate_hz === 0 && edge.dropped_hz === 0 && "idle",
    edge.flagged && "flagged",
    (edge.source === chosen || edge.target === chosen) && "chosen",
  ].filter((state) => state !== false);
  const width = 1 + Math.log10(1 + edge.rate_hz);
  return svg`<path class=${["line", ...states].join(" ")} d=${path} stroke-width=${width.toFixed(2)}></path>`;
}

/** @param {EdgeDocument} edge @param {Route} route */
function rateOf(edge, { end }) {
  const { passed, lost } = edgeRate(edge);
  if (!passed && !lost) return null;
  return svg`<text class="rate" x=${end.x - 5} y=${end.y - 3} text-anchor="end">
    ${passed}${lost && svg`<tspan class=${edge.flagged ? "lost flagged" : "lost"}> −${lost}</tspan>`}
  </text>`;
}

/** @param {Box} box @param {PartDocument} part @param {EngineDocument} engine @param {Choice} choice */
function boxOf({ name, x, y, height }, part, engine, { chosen, choose }) {
  const middle = y + height / 2;
  const act = () => choose(name);
  const classes = ["part", part.kind, part.flagged && "flagged", name === chosen && "chosen"].filter(Boolean);
  return svg`<g
    class=${classes.join(" ")} tabindex="0" role="button" aria-pressed=${String(name === chosen)}
    aria-label=${partWords(part, engine)} data-part=${name} @focus=${act} @click=${act}
  >
    <rect x=${x} y=${y} width=${BOX.width} height=${height} rx=${part.kind === "thread" ? 4 : 14}></rect>
    <text class="name" x=${x + 10} y=${middle - 3}>${partName(part)}</text>
    <text class="load" x=${x + 10} y=${middle + 12}>${partState(part, engine)}</text>
    ${part.busy_share !== null && svg`<rect class="busy" x=${x} y=${y + height - BAR_HEIGHT} width=${BOX.width * Math.min(part.busy_share, 1)} height=${BAR_HEIGHT}></rect>`}
  </g>`;
}
