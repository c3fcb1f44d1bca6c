#!/bin/sh
# Installs Debian's libaravis and its fake GigE Vision camera, which the camera tests talk to. Does nothing when
# they are there. Where they cannot be had, those tests are skipped and say so.
set -eu

if [ -x /usr/bin/arv-fake-gv-camera-0.8 ]; then # it links the library
  exit 0
fi

missing() {
  echo "The tests of GigE Vision cameras are skipped: $1" >&2
  echo "They need libaravis and its fake camera (Debian, Ubuntu: 'apt-get install libaravis-0.8-0 aravis-tools')." >&2
  exit 0
}

. "$(dirname "$0")/debian-packages.sh"
prepare "libaravis and its fake camera for the camera tests (once, half a minute)"
install libaravis-0.8-0 aravis-tools || missing "'apt-get install' failed; its messages are above."
