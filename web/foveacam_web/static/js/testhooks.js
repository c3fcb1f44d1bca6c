// What the browser tests and the bench read from the page; web/README.md lists it. The page itself never reads it.

/**
 * @typedef {import("./store.js").Store} Store
 * @typedef {import("./video/views.js").Views} Views
 * @typedef {import("#page").ViewName} ViewName
 */

/** @param {{store: Store, views: Views}} context */
export function exposeHooks({ store, views }) {
  Object.assign(window, {
    foveacam: Object.freeze({
      /** Frames drawn so far, by view. */
      frames: () => Object.fromEntries(Object.entries(store.state.shown).map(([name, view]) => [name, view.count])),
      /** Frames per second drawn of late, by view. */
      rates: () => Object.fromEntries(Object.entries(store.state.shown).map(([name, view]) => [name, view.fps])),
      /** The wide pixel of the last click. */
      lastClick: () => views.wide.last_click,
      /** Where on the page the centre of a wide pixel is now, CSS px. */
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
