// The worker that decodes and draws the views, so that the 3D pane's work on the page's thread does not slow them.

import { ViewStream } from "./stream.js";

/** @import { StreamOrder } from "#page" */

/** @type {ViewStream | null} */
let stream = null;

/** @param {MessageEvent<StreamOrder>} event */
self.onmessage = ({ data }) => {
  if (data.type === "start") stream = new ViewStream(data.url, (report) => self.postMessage(report));
  else if (data.type === "canvas") stream?.addCanvas(data.view, data.canvas);
  else if (data.type === "loupe-canvas") stream?.setLoupeCanvas(data.canvas);
  else if (data.type === "loupe") stream?.aimLoupe(data.at, data.zoom);
  else if (data.type === "halt") stream?.halt(data.halted);
  else stream?.subscribe(data.views);
};
