// An element that plots curves with their errors, with a cursor that reads values and a zoom along x (drag; double click shows
// all). uPlot draws it; the library is loaded with the first plot.

import { h } from "./dom.js";
import { MISSING, number } from "./format.js";

/**
 * @import uPlot from "../../vendor/uplot/uPlot.js"
 * @typedef {{x: number, y: number, sigma: number}} BandPoint
 * @typedef {{name: string, colour: string, runs: BandPoint[][], dash?: number[], dot_px?: number, mark?: boolean}} Curve
 *   `colour`: a name of tokens.css; `runs`: parts between which it is open; `mark`: no values are read from it
 * @typedef {{from: number, to: number}} Span
 * @typedef {{
 *   words: string, height?: number, curves: Curve[],
 *   x: Span & {name: string, whole?: boolean, text?: (x: number) => string}, y: {name: string, least?: number, log?: boolean, span?: Span}
 * }} PlotSpec `text`: of an x at the cursor; `least`: the least margin above and below; `span`: ends that are fixed
 */

const LEAST_SHARE = 1e-4; // of the value: the axis of a flat curve must not magnify noise
const LINE_PX = 1.6;
const MOUSE = Object.freeze({
  pointerdown: ["mousemove", "mousedown"], // a press alone reads nothing, and a long one is no tap
  pointermove: ["mousemove"],
  pointerup: ["mouseup"],
  pointercancel: ["mouseup"],
});

/** @type {Promise<typeof uPlot> | null} */
let loading = null;

/** Load uPlot and its style sheet, once. */
function library() {
  loading ??= (async () => {
    const href = new URL("../../vendor/uplot/uPlot.min.css", import.meta.url).href;
    document.head.append(h("link", { rel: "stylesheet", href }));
    const redraw = () =>
      document.querySelectorAll("value-plot").forEach((each) => each instanceof ValuePlot && each.redraw());
    new MutationObserver(redraw).observe(document.documentElement, { attributeFilter: ["data-theme"] });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
    return (await import("../../vendor/uplot/uPlot.js")).default;
  })();
  return loading;
}

class ValuePlot extends HTMLElement {
  #probe = h("i", { hidden: true });
  /** @type {uPlot | null} */
  #plot = null;
  #curves = "";
  /** @type {Span} the axis of x when it was drawn last */
  #axis = { from: 0, to: 0 };
  #sized = new ResizeObserver(() => {
    if (this.clientWidth > 0) this.#plot?.setSize({ width: this.clientWidth, height: this.spec.height ?? 150 });
  });
  /** @type {PlotSpec} */
  #spec = { words: "", curves: [], x: { name: "", from: 0, to: 1 }, y: { name: "" } };

  get spec() {
    return this.#spec;
  }

  set spec(spec) {
    this.#spec = spec;
    if (this.isConnected) void this.#show();
  }

  connectedCallback() {
    this.append(this.#probe);
    this.#sized.observe(this);
    void this.#show();
  }

  disconnectedCallback() {
    this.#sized.disconnect();
    this.#plot?.destroy();
    this.#plot = null;
  }

  redraw() {
    this.#plot?.redraw(false);
  }

  async #show() {
    const UPlot = await library();
    if (!this.isConnected) return;
    const data = UPlot.join(this.spec.curves.map(tableOf));
    const curves = JSON.stringify(this.spec.curves.map(({ runs, ...style }) => style));
    if (this.#plot && curves === this.#curves) {
      const { min, max } = /** @type {Record<"min" | "max", number>} */ (this.#plot.scales["x"]);
      const zoomed = min !== null && (min > this.#axis.from || max < this.#axis.to);
      this.#plot.setData(data, !zoomed);
      if (zoomed) this.#plot.setScale("x", { min, max });
    } else {
      this.#plot?.destroy();
      this.#plot = new UPlot(optionsOf(this), data, this);
      this.#curves = curves;
      followFinger(this.#plot.over);
    }
    this.#axis = this.spec.x;
    const picture = this.#plot.over.parentElement;
    picture?.setAttribute("role", "img");
    picture?.setAttribute("aria-label", this.spec.words);
  }

  /** Return a colour as a canvas understands it. @param {string} token @param {number} [percent] of opacity */
  colour(token, percent = 100) {
    this.#probe.style.color = `color-mix(in srgb, var(${token}) ${percent}%, transparent)`;
    return getComputedStyle(this.#probe).color;
  }
}

/** Let one finger do what the mouse does; uPlot knows no other pointers. @param {HTMLElement} element */
function followFinger(element) {
  for (const [pointer, events] of Object.entries(MOUSE)) {
    element.addEventListener(pointer, (event) => {
      const { pointerType, clientX, clientY } = /** @type {PointerEvent} */ (event);
      if (pointerType !== "touch") return;
      for (const mouse of events)
        element.dispatchEvent(new MouseEvent(mouse, { bubbles: true, clientX, clientY, movementX: 1 }));
    });
  }
}

/** Return a curve as columns: x, y, and y less and plus its standard error. @param {Curve} curve @returns {uPlot.AlignedData} */
function tableOf({ runs }) {
  const points = runs.flatMap((run, index) => {
    const [end, next] = [runs[index - 1]?.at(-1), run[0]];
    return end && next ? [{ x: (end.x + next.x) / 2, y: null, sigma: 0 }, ...run] : run;
  });
  const side = (/** @type {number} */ sign) => points.map(({ y, sigma }) => (y === null ? null : y + sign * sigma));
  return [points.map(({ x }) => x), side(0), side(-1), side(1)];
}

/** @param {ValuePlot} element @returns {uPlot.Options} */
function optionsOf(element) {
  const { x, y, curves, height = 150 } = element.spec;
  const lines = { stroke: () => element.colour("--line-soft"), width: 1 };
  const font = `11px ${getComputedStyle(element).fontFamily}`;
  const axis = {
    stroke: () => element.colour("--text-soft"),
    font,
    labelFont: font,
    labelSize: 16,
    ticks: lines,
    values: (/** @type {uPlot} */ _, /** @type {(number | null)[]} */ splits) => splits.map(textOf),
  };
  return {
    width: element.clientWidth || 320,
    height,
    padding: [8, 10, 0, 0],
    cursor: {
      y: false,
      bind: { mouseleave: (_, __, leave) => (event) => (matchMedia("(hover: none)").matches ? null : leave(event)) }, // a tap's reading stays
    },
    legend: { markers: { stroke: (_, series) => `var(${curves[Math.floor((series - 1) / 3)]?.colour})` } },
    scales: {
      x: { time: false, range: ({ data: [places] }, low, high) => rangeOfX(element.spec.x, places, { low, high }) },
      y: { distr: y.log ? 3 : 1, range: (_, low, high) => rangeOfY(element.spec.y, low, high) },
    },
    axes: [
      {
        ...axis,
        label: x.name,
        size: 28,
        grid: { show: false },
        ...(x.whole && { incrs: [1, 2, 5, 10, 20], space: 24 }),
      },
      { ...axis, label: y.name, size: 52, grid: { ...lines, ...(y.log && { filter: decades }) } },
    ],
    series: [
      { label: x.name, value: (_, value) => (value === null ? MISSING : (element.spec.x.text ?? textOf)(value)) },
      ...curves.flatMap((curve) => seriesOf(element, curve)),
    ],
    bands: curves.map(({ colour }, at) => ({
      series: [3 * at + 3, 3 * at + 2],
      fill: () => element.colour(colour, 25),
    })),
  };
}

/** @param {ValuePlot} element @param {Curve} curve @returns {uPlot.Series[]} a curve and the edges of its band */
function seriesOf(element, { name, colour, dash = [], dot_px, mark }) {
  const stroke = () => element.colour(colour);
  /** @type {uPlot.Series} */
  const edge = { class: "edge", stroke: "transparent", width: 0, points: { show: false } };
  /** @type {uPlot.Series.Value} */
  const value = ({ data }, y, series, at) => {
    const sigma = at === null ? 0 : (data[series + 2]?.[at] ?? 0) - y;
    if (mark || y === null) return mark ? "" : MISSING;
    return sigma > 0 ? `${number(y, 3)} ± ${number(sigma, 3)}` : textOf(y);
  };
  const points = { show: !mark || dot_px !== undefined, size: dot_px ?? LINE_PX + 0.6, width: 0, fill: stroke };
  return [{ label: name, class: mark ? "mark" : "curve", stroke, width: LINE_PX, dash, points, value }, edge, edge];
}

/**
 * Return the part of x that is shown: all of the axis, also where points reach less far, or what was zoomed to.
 * @param {Span} axis @param {ArrayLike<number>} places @param {{low: number, high: number}} asked
 * @returns {[number, number]}
 */
function rangeOfX({ from, to }, places, { low, high }) {
  const all = places.length < 2 || (low <= (places[0] ?? low) && high >= (places[places.length - 1] ?? high));
  return all ? [from, to] : [Math.max(from, low), Math.min(to, high)];
}

/** @param {PlotSpec["y"]} y @param {number | null} low @param {number | null} high @returns {[number, number]} */
function rangeOfY({ span, least = 0 }, low, high) {
  if (span) return [span.from, span.to];
  if (low === null || high === null) return [0, 1];
  const margin = Math.max(0.05 * (high - low), LEAST_SHARE * Math.abs(high), least);
  return [low - margin, high + margin];
}

/** Keep the powers of ten of the lines of a logarithmic axis. @type {uPlot.Axis.Filter} */
const decades = (_, splits) => splits.map((each) => (Number.isInteger(Math.log10(each)) ? each : null));

/** @param {number | null} value */
function textOf(value) {
  return value === null ? "" : String(Number(value.toPrecision(4))).replace("-", "−");
}

customElements.define("value-plot", ValuePlot);
