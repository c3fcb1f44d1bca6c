#!/bin/sh
# Checks the console's code: the types generated from the OpenAPI document are current, the modules keep to their types, and
# prettier formats them as they are.
set -eu
cd "$(dirname "$0")"
. ./node-tools.sh

sh generate-types.sh --check
for project in tsconfig.json tsconfig.worker.json; do
  tsc --project "$project"
done
prettier --check --log-level warn .
echo "check-types: the console's types hold."
