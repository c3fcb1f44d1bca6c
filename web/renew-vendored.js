// Writes the libraries of static/vendor and tests/vendored from the npm registry: the versions and files that
// packages.json there names, and their hashes into it. For another version, change its number there and run `.venv/bin/node web/renew-vendored.js`.

import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const FOLDERS = ["foveacam_web/static/vendor", "tests/vendored"].map((at) =>
  fileURLToPath(new URL(at, import.meta.url)),
);
const NPM = fileURLToPath(new URL("../.venv/bin/npm", import.meta.url));
const work = mkdtempSync(join(tmpdir(), "vendored-"));
try {
  for (const folder of FOLDERS) renew(folder);
} finally {
  rmSync(work, { recursive: true });
}

/** @param {string} folder */
function renew(folder) {
  const list = join(folder, "packages.json");
  const packages = JSON.parse(readFileSync(list, "utf8"));
  for (const [name, { version, files }] of Object.entries(packages)) {
    const packed = execFileSync(NPM, ["pack", "--silent", `${name}@${version}`, "--pack-destination", work]);
    execFileSync("tar", ["xzf", join(work, packed.toString().trim()), "-C", work]);
    for (const [file, taken] of Object.entries(files)) {
      const published = readFileSync(join(work, "package", taken.from), "utf8");
      const text = published.replace(/\n?\/\/# sourceMappingURL=.*\n?$/, "\n") + (taken.append ?? "");
      mkdirSync(dirname(join(folder, name, file)), { recursive: true });
      writeFileSync(join(folder, name, file), text);
      taken.sha256 = createHash("sha256").update(text).digest("hex");
    }
    rmSync(join(work, "package"), { recursive: true });
  }
  writeFileSync(list, `${JSON.stringify(packages, null, 2)}\n`);
}
