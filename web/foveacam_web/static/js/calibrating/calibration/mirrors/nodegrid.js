// Shows the nodes of a running sweep: both eyes' state at each, and the reason of a refusal under pointer or focus.

import { fill, h, html, setText } from "../../../elements/dom.js";
import { angle, sentence } from "../../../elements/format.js";

/**
 * @import { SweepDocument, SweepPoseDocument } from "#api"
 * @import { NodeState } from "#page"
 */

/** @type {Readonly<Record<NodeState, {sign: string, word: string}>>} */
const STATES = Object.freeze({
  centred: { sign: "●", word: "centred" },
  rim: { sign: "◐", word: "at the rim of its reach" },
  refused: { sign: "×", word: "refused" },
  waiting: { sign: "·", word: "waiting" },
});

/** The grid of one sweep; its elements stay while the sweep runs, and with them the focus. */
export class NodeGrid {
  #grid = h("div", { class: "nodes", role: "grid", "aria-label": "Nodes of the sweep" });
  #detail = h("p", { class: "node-detail", role: "status" });
  /** @type {Map<number, HTMLElement>} */
  #cells = new Map();
  /** @type {SweepPoseDocument[]} */
  #poses = [];
  #columns = 1;
  #layout = "";
  #chosen = -1;

  constructor() {
    this.element = h("div", { class: "node-grid" }, this.#grid, legend(), this.#detail);
    this.#grid.addEventListener("keydown", (event) => this.#key(event));
    this.#grid.addEventListener("focusin", (event) => this.#choose(indexOf(event.target)));
    this.#grid.addEventListener("pointerover", (event) => this.#choose(indexOf(event.target)));
    this.#grid.addEventListener("click", (event) => this.#choose(indexOf(event.target)));
  }

  /** @param {SweepDocument | null} sweep */
  update(sweep) {
    this.#poses = sweep?.poses ?? [];
    const layout = `${sweep?.station}: ${this.#poses.map(({ index, ax_deg, ay_deg }) => `${index} ${ax_deg} ${ay_deg}`).join()}`;
    if (layout !== this.#layout) this.#lay();
    this.#layout = layout;
    for (const pose of this.#poses) this.#showPose(pose);
    this.#showDetail();
  }

  /** Arrange the nodes by gaze: columns by ax, rows by ay; in their order when they form no grid. */
  #lay() {
    const across = places(this.#poses.map(({ ax_deg }) => ax_deg));
    const down = places(this.#poses.map(({ ay_deg }) => ay_deg));
    const lattice = across.length * down.length <= Math.max(1, this.#poses.length * 2);
    this.#columns = lattice ? across.length : Math.ceil(Math.sqrt(this.#poses.length));
    this.#grid.style.setProperty("--columns", String(Math.max(1, this.#columns)));
    this.#cells.clear();
    /** @type {Map<number, HTMLElement[]>} */
    const rows = new Map();
    this.#poses.forEach((pose, order) => {
      const cell = h(
        "div",
        { class: "node", role: "gridcell", tabindex: "-1", data: { index: String(pose.index) } },
        eye("left"),
        eye("right"),
      );
      const row = lattice ? down.indexOf(rounded(pose.ay_deg)) : Math.floor(order / this.#columns);
      const column = lattice ? across.indexOf(rounded(pose.ax_deg)) : order % this.#columns;
      cell.style.gridColumn = String(column + 1);
      cell.dataset["column"] = String(column);
      rows.set(row, [...(rows.get(row) ?? []), cell]);
      this.#cells.set(pose.index, cell);
    });
    const heads = lattice
      ? [
          h(
            "div",
            { class: "row heads", "aria-hidden": "true" },
            across.map((ax_deg) => html`<span>${angle(ax_deg, 1)}</span>`),
          ),
        ]
      : [];
    fill(
      this.#grid,
      ...heads,
      ...[...rows]
        .sort(([a], [b]) => a - b)
        .map(
          ([row, cells]) =>
            html`<div class="row" role="row">
            ${cells.sort((a, b) => Number(a.dataset["column"]) - Number(b.dataset["column"]))}
            ${lattice && html`<span class="head" aria-hidden="true">${angle(down[row], 1)}</span>`}
          </div>`,
        ),
    );
    const first = this.#grid.querySelector(".node");
    if (first instanceof HTMLElement) first.tabIndex = 0;
    this.#chosen = -1;
  }

  /** @param {SweepPoseDocument} pose */
  #showPose(pose) {
    const cell = this.#cells.get(pose.index);
    if (!cell) return;
    const name = inWords(pose);
    if (cell.ariaLabel !== name) cell.ariaLabel = name;
    for (const side of /** @type {const} */ (["left", "right"])) {
      const mark = /** @type {HTMLElement} */ (cell.querySelector(`.${side}`));
      mark.dataset["state"] = pose[side];
      setText(mark, STATES[pose[side]].sign);
    }
  }

  /** @param {number | null} index */
  #choose(index) {
    if (index === null || index === this.#chosen) return;
    this.#chosen = index;
    for (const [each, cell] of this.#cells) cell.classList.toggle("chosen", each === index);
    this.#showDetail();
  }

  #showDetail() {
    const pose = this.#poses.find(({ index }) => index === this.#chosen);
    setText(
      this.#detail,
      pose
        ? inWords(pose)
        : this.#poses.length
          ? "Point at a node, or move with the arrow keys, to read how it went."
          : "",
    );
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const step = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] }[event.key];
    const from = event.target;
    if (!step || !(from instanceof HTMLElement) || !from.parentElement) return;
    event.preventDefault();
    const rows = [...this.#grid.querySelectorAll("[role=row]")];
    const row = rows[rows.indexOf(from.parentElement) + (step[0] ?? 0)];
    const column = Number(from.dataset["column"]) + (step[1] ?? 0);
    const to =
      row && [...row.children].find((cell) => Number(/** @type {HTMLElement} */ (cell).dataset["column"]) === column);
    if (!(to instanceof HTMLElement)) return;
    from.tabIndex = -1;
    to.tabIndex = 0;
    to.focus();
  }
}

/** @param {"left" | "right"} side */
function eye(side) {
  return html`<span class="eye ${side}" aria-hidden="true"></span>`;
}

/** @param {SweepPoseDocument} pose */
function inWords(pose) {
  const eyeWords = (/** @type {string} */ name, /** @type {NodeState} */ state, /** @type {string | null} */ reason) =>
    `${name} ${STATES[state].word}${reason ? ` (${reason})` : ""}`;
  return (
    `Node ${pose.index + 1} at ${angle(pose.ax_deg, 1)}, ${angle(pose.ay_deg, 1)}: ` +
    sentence(
      `${eyeWords("left", pose.left, pose.left_reason)}; ${eyeWords("right", pose.right, pose.right_reason)}`,
    ).replace(/^L/, "l")
  );
}

function legend() {
  return html`<p class="legend" aria-hidden="true">
    <span class="eyes">
      <span class="eye left" data-state="centred">●</span>
      left <span class="eye right" data-state="centred">●</span>
      right
    </span>
    ${Object.values(STATES).map(({ sign, word }) => html`<span>${sign} ${word}</span>`)}
  </p>`;
}

/** @param {EventTarget | null} target */
function indexOf(target) {
  const cell = target instanceof Element ? target.closest(".node") : null;
  return cell instanceof HTMLElement ? Number(cell.dataset["index"]) : null;
}

/** @param {number} value_deg */
function rounded(value_deg) {
  return Math.round(value_deg * 100) / 100;
}

/** @param {number[]} values_deg */
function places(values_deg) {
  return [...new Set(values_deg.map(rounded))].sort((a, b) => a - b);
}
