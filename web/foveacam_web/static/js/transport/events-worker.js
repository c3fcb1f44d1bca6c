// Holds one event stream for all tabs of the browser. A browser opens about six connections to a server: an event
// stream in every tab would use them up, and the stop button would wait for one.

import { keepEvents } from "./eventsource.js";

/** @import { EventNews } from "./eventsource.js" */

/** @type {Set<MessagePort>} */
const ports = new Set();
/** @type {EventNews} */
let link = { type: "link", open: false };

/** @param {EventNews} news */
function sendToAll(news) {
  if (news.type === "link") link = news;
  for (const port of ports) port.postMessage(news);
}

/** @param {MessageEvent} event */
function welcome(event) {
  const port = event.ports[0];
  if (!port) return;
  ports.add(port);
  port.onmessage = ({ data }) => {
    if (data === "again") kept.again();
    else ports.delete(port); // a page says that it closes
  };
  port.postMessage(link);
  kept.again(); // a page that loads now may have signed in
}

const kept = keepEvents(sendToAll);
/** @type {{onconnect: ((event: MessageEvent) => void) | null}} */ (/** @type {unknown} */ (self)).onconnect = welcome;
