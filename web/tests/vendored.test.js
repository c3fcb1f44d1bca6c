import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { test } from "node:test";

/** The console's libraries, which ship with it, and those of its tests. */
const FOLDERS = ["../foveacam_web/static/vendor/", "./vendored/"].map((at) =>
  fileURLToPath(new URL(at, import.meta.url)),
);
/** @typedef {Record<string, {version: string, licence: string, files: Record<string, {sha256: string}>}>} Packages */
/** @type {{folder: string, packages: Packages}[]} */
const LISTS = FOLDERS.map((folder) => ({
  folder,
  packages: JSON.parse(readFileSync(`${folder}packages.json`, "utf8")),
}));
const listed = LISTS.flatMap(({ folder, packages }) =>
  Object.entries(packages).flatMap(([name, { files }]) =>
    Object.entries(files).map(([file, { sha256 }]) => ({ path: `${folder}${name}/${file}`, sha256 })),
  ),
);

test("the libraries are those that renew-vendored.js wrote", () => {
  assert.ok(listed.length > 0);
  for (const { path, sha256 } of listed)
    assert.equal(createHash("sha256").update(readFileSync(path)).digest("hex"), sha256, path);
});

test("each library has a fixed version and comes with its licence", () => {
  for (const { packages } of LISTS)
    for (const [name, { version, licence, files }] of Object.entries(packages)) {
      assert.match(version, /^\d+\.\d+\.\d+$/, name);
      assert.match(licence, /^(MIT|BSD-3-Clause|MPL-2\.0)$/, name);
      assert.ok("LICENSE" in files, name);
    }
});

test("beside them lie only declarations of our own", () => {
  const names = new Set([...FOLDERS.map((folder) => `${folder}packages.json`), ...listed.map(({ path }) => path)]);
  for (const folder of FOLDERS)
    for (const entry of readdirSync(folder, { recursive: true, withFileTypes: true }).filter((each) => each.isFile())) {
      const path = `${entry.parentPath}/${entry.name}`.replaceAll("//", "/");
      assert.ok(names.has(path) || path.endsWith(".d.ts"), path);
    }
});
