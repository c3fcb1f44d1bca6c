// Writes the libraries of static/vendor from the npm registry: the versions and files that packages.json there names, and
// their hashes into it. For another version, change its number there and run `.venv/bin/node web/renew-vendored.js`.

import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const VENDOR = fileURLToPath(new URL("foveacam_web/static/vendor", import.meta.url));
const NPM = fileURLToPath(new URL("../.venv/bin/npm", import.meta.url));
const LIST = join(VENDOR, "packages.json");

const packages = JSON.parse(readFileSync(LIST, "utf8"));
const work = mkdtempSync(join(tmpdir(), "vendored-"));
try {
  for (const [name, { version, files }] of Object.entries(packages)) {
    const packed = execFileSync(NPM, ["pack", "--silent", `${name}@${version}`, "--pack-destination", work]);
    execFileSync("tar", ["xzf", join(work, packed.toString().trim()), "-C", work]);
    for (const [file, taken] of Object.entries(files)) {
      const published = readFileSync(join(work, "package", taken.from), "utf8");
      const text = published.replace(/\n?\/\/# sourceMappingURL=.*\n?$/, "\n") + (taken.append ?? "");
      mkdirSync(dirname(join(VENDOR, name, file)), { recursive: true });
      writeFileSync(join(VENDOR, name, file), text);
      taken.sha256 = createHash("sha256").update(text).digest("hex");
    }
    rmSync(join(work, "package"), { recursive: true });
  }
  writeFileSync(LIST, `${JSON.stringify(packages, null, 2)}\n`);
} finally {
  rmSync(work, { recursive: true });
}
