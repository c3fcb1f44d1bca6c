#!/bin/sh
# Writes types/api.d.ts from the committed OpenAPI document. --check: write nothing, fail when the file is not current.
set -eu
cd "$(dirname "$0")"
. ./node-tools.sh

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
node rest-schemas.js > "$work/schemas.json"
openapi-typescript "$work/schemas.json" --output "$work/api.d.ts" \
  --alphabetize --default-non-nullable=false --root-types --root-types-no-schema-prefix > "$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }

if [ "${1:-}" != --check ]; then
  cp "$work/api.d.ts" types/api.d.ts
elif ! cmp -s "$work/api.d.ts" types/api.d.ts; then
  echo "generate-types: web/types/api.d.ts does not describe tests/data/openapi.json; run 'sh web/generate-types.sh'." >&2
  exit 1
fi
