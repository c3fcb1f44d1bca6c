// Connects the page to the event stream: by the SharedWorker of all tabs, or by a stream of its own where there is
// none.

import { keepEvents } from "./eventsource.js";

/** @import { EventLink, EventNews } from "./eventsource.js" */

/**
 * Listen to the events for as long as the page lives.
 * @param {(news: EventNews) => void} onNews
 * @returns {EventLink}
 */
export function listenToEvents(onNews) {
  if (typeof SharedWorker !== "function") return keepEvents(onNews);
  /** @type {MessagePort} */
  let joined;
  const join = () => {
    const { port } = new SharedWorker(new URL("./events-worker.js", import.meta.url), {
      type: "module",
      name: "events",
    });
    joined = port;
    port.onmessage = ({ data }) => onNews(data);
    window.addEventListener("pagehide", () => port.postMessage("bye"), { once: true });
  };
  join();
  window.addEventListener("pageshow", (event) => event.persisted && join());
  return { again: () => joined.postMessage("again") };
}
