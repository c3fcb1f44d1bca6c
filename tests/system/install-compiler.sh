#!/bin/sh
# Installs Debian's C compiler, with which the tests build the controller's firmware for this machine. Does nothing
# when there is one. Where none can be had, those tests are skipped and say so.
set -eu

if command -v cc >/dev/null && command -v make >/dev/null; then
  exit 0
fi

missing() {
  echo "The tests of the controller's firmware are skipped: $1" >&2
  echo "They need a C compiler and make (Debian, Ubuntu: 'apt-get install gcc libc6-dev make')." >&2
  exit 0
}

. "$(dirname "$0")/debian-packages.sh"
prepare "a C compiler for the firmware's tests (once, half a minute)"
install gcc libc6-dev make || missing "'apt-get install' failed; its messages are above."
