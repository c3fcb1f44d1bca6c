// Defines `window.foveacam`, which the browser tests and the bench read; web/README.md lists it. The page never reads
// it.

/**
 * @import { Store } from "#console"
 * @import { Views } from "./video/views.js"
 */

/** @param {{store: Store, views: Views}} context */
export function exposeHooks({ store, views }) {
  Object.assign(window, {
    foveacam: Object.freeze({
      /** Frames drawn so far, by view. */
      frames: () => Object.fromEntries(Object.entries(store.state.shown).map(([name, view]) => [name, view.count])),
      /** Recent rate of drawn frames in Hz, by view. */
      rates: () => Object.fromEntries(Object.entries(store.state.shown).map(([name, view]) => [name, view.fps])),
      /** The wide pixel of the last click. */
      lastClick: () => views.wide.last_click,
      /** Position of the centre of a wide pixel on the page, CSS px. */
      pageOf: (/** @type {number} */ x, /** @type {number} */ y) => {
        const { viewport, surface } = views.pane("wide");
        const box = surface.getBoundingClientRect();
        const at = viewport.toCss({ x, y });
        return { x: box.left + at.x, y: box.top + at.y };
      },
      stream: () => store.state.stream,
      bootId: () => store.state.boot_id,
    }),
  });
}
