#!/bin/sh
# Tests what the console computes and says: the modules that need no browser, by node's own test runner.
set -eu
cd "$(dirname "$0")"
. ./node-tools.sh

node --test --test-timeout=60000 --test-reporter=dot "tests/**/*.test.js"
