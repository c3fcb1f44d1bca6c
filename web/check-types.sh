#!/bin/sh
# Checks the console's code: the types generated from the OpenAPI document are current, and the modules keep to their types.
set -eu
cd "$(dirname "$0")"
. ./node-tools.sh

sh generate-types.sh --check
for project in tsconfig.json tsconfig.worker.json; do
  tsc --project "$project"
done
echo "check-types: the console's types hold."
