// Starts Swagger UI on the page at /docs with the server's OpenAPI document. Its own script defines it on `window`.

import { ROOT } from "./root.js";

/** @type {(options: Record<string, unknown>) => void} */
const showInterface = /** @type {any} */ (window).SwaggerUIBundle;

showInterface({
  url: `${ROOT}/openapi.json`,
  dom_id: "#interface",
  deepLinking: true,
  filter: true,
  docExpansion: "none", // to draw all operations takes a browser ten seconds and more
  validatorUrl: null, // no request goes to another server
});
