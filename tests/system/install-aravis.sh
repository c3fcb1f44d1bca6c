#!/bin/sh
# Installs Debian's libaravis and its fake GigE Vision camera, which the camera tests talk to. Does nothing when
# they are there. Where they cannot be had, those tests are skipped and say so.
set -eu

if [ -x /usr/bin/arv-fake-gv-camera-0.8 ]; then # it links the library
  exit 0
fi

explain() {
  echo "The tests of GigE Vision cameras are skipped: $1" >&2
  echo "They need libaravis and its fake camera (Debian, Ubuntu: 'apt-get install libaravis-0.8-0 aravis-tools')." >&2
  exit 0
}

command -v apt-get >/dev/null || explain "this machine has no apt-get."

as_root=""
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || explain "apt-get needs root, and there is no sudo."
  as_root="sudo"
fi

echo "Installing libaravis and its fake camera for the camera tests (once, half a minute) ..."
$as_root apt-get update -qq || explain "'apt-get update' failed; is the network up?"
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
  libaravis-0.8-0 aravis-tools >/dev/null || explain "'apt-get install' failed; its messages are above."
