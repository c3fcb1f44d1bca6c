// Prints the schemas of the committed OpenAPI document as generate-types.sh turns them into types: without the paths, and
// with every field required that the server always sends.

import { readFile } from "node:fs/promises";

const OPENAPI = new URL("../tests/data/openapi.json", import.meta.url);
const PARTIAL = new Set(["Problem"]); // the server leaves out those of its fields that are empty

/**
 * Return the names of all schemas that a part of the document refers to, directly or through others.
 * @param {unknown} part
 * @param {Record<string, unknown>} schemas
 * @param {Set<string>} [found]
 */
function referredSchemas(part, schemas, found = new Set()) {
  for (const [, name] of JSON.stringify(part).matchAll(/"#\/components\/schemas\/(\w+)"/g)) {
    if (name && !found.has(name)) referredSchemas(schemas[name], schemas, found.add(name));
  }
  return found;
}

/**
 * Drop what would only be noise beside a type: the titles that pydantic derives from the names, and long defaults.
 * @param {string} key
 * @param {unknown} value
 */
function withoutNoise(key, value) {
  const title = key === "title" && typeof value === "string";
  const long_default = key === "default" && typeof value === "object";
  return title || long_default ? undefined : value;
}

const document = JSON.parse(await readFile(OPENAPI, "utf8"));
const { schemas } = JSON.parse(JSON.stringify(document.components), (key, value) => withoutNoise(key, value));
const operations = Object.values(document.paths).flatMap((path) => Object.values(path));
const responses = operations.map((operation) => operation.responses);
for (const name of referredSchemas(responses, schemas)) {
  const { properties } = schemas[name];
  if (properties && !PARTIAL.has(name)) schemas[name].required = Object.keys(properties); // FastAPI sends defaults, too
}
console.log(JSON.stringify({ openapi: document.openapi, info: document.info, paths: {}, components: { schemas } }));
