// The page at /docs: Swagger UI, which its own script has put into the window, shows the server's document.

/** @type {(options: Record<string, unknown>) => void} */
const showInterface = /** @type {any} */ (window).SwaggerUIBundle;

showInterface({
  url: "/openapi.json",
  dom_id: "#interface",
  deepLinking: true,
  filter: true,
  validatorUrl: null, // nothing is asked of other servers
});
