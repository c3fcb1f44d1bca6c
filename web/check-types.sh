#!/bin/sh
# Checks the console's code: the types generated from the OpenAPI document are current, the modules keep to their types,
# prettier has formatted them, and their unit tests pass.
set -eu
cd "$(dirname "$0")"
. ./node-tools.sh

sh generate-types.sh --check
for project in tsconfig.json tsconfig.worker.json tsconfig.tests.json; do
  tsc --project "$project" --typeRoots "$tools/node_modules/@types"
done
prettier --check --log-level warn .
echo "check-types: the console's types hold."
sh test-page.sh
