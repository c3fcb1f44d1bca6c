import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { test } from "node:test";

const VENDOR = fileURLToPath(new URL("../foveacam_web/static/vendor/", import.meta.url));
/** @type {Record<string, {version: string, licence: string, files: Record<string, {sha256: string}>}>} */
const packages = JSON.parse(readFileSync(`${VENDOR}packages.json`, "utf8"));
const listed = Object.entries(packages).flatMap(([name, { files }]) =>
  Object.entries(files).map(([file, { sha256 }]) => ({ path: `${name}/${file}`, sha256 })),
);

test("the libraries are those that renew-vendored.js wrote", () => {
  assert.ok(listed.length > 0);
  for (const { path, sha256 } of listed)
    assert.equal(
      createHash("sha256")
        .update(readFileSync(VENDOR + path))
        .digest("hex"),
      sha256,
      path,
    );
});

test("each library has a fixed version and comes with its licence", () => {
  for (const [name, { version, licence, files }] of Object.entries(packages)) {
    assert.match(version, /^\d+\.\d+\.\d+$/, name);
    assert.match(licence, /^(MIT|BSD-3-Clause)$/, name);
    assert.ok("LICENSE" in files, name);
  }
});

test("beside them lie only declarations of our own", () => {
  const names = new Set(["packages.json", ...listed.map(({ path }) => path)]);
  const found = readdirSync(VENDOR, { recursive: true, withFileTypes: true });
  for (const entry of found.filter((each) => each.isFile())) {
    const path = `${entry.parentPath}/${entry.name}`.replaceAll("//", "/").slice(VENDOR.length);
    assert.ok(names.has(path) || path.endsWith(".d.ts"), path);
  }
});
