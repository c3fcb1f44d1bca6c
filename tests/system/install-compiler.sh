#!/bin/sh
# Installs Debian's C compiler, with which the tests build the controller's firmware for this machine. Does nothing
# when there is one. Where none can be had, those tests are skipped and say so.
set -eu

if command -v cc >/dev/null && command -v make >/dev/null; then
  exit 0
fi

explain() {
  echo "The tests of the controller's firmware are skipped: $1" >&2
  echo "They need a C compiler and make (Debian, Ubuntu: 'apt-get install gcc libc6-dev make')." >&2
  exit 0
}

command -v apt-get >/dev/null || explain "this machine has no apt-get."

as_root=""
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || explain "apt-get needs root, and there is no sudo."
  as_root="sudo"
fi

echo "Installing a C compiler for the firmware's tests (once, half a minute) ..."
$as_root apt-get update -qq || explain "'apt-get update' failed; is the network up?"
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
  gcc libc6-dev make >/dev/null || explain "'apt-get install' failed; its messages are above."
