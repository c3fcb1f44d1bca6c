#!/bin/sh
# Installs Debian's nginx, behind which the tests put a server. Does nothing when it is there. Where it cannot be had,
# those tests are skipped and say so.
set -eu

if [ -x /usr/sbin/nginx ] || command -v nginx >/dev/null; then
  exit 0
fi

missing() {
  echo "The tests of a server behind a proxy are skipped: $1" >&2
  echo "They need nginx (Debian, Ubuntu: 'apt-get install nginx-light')." >&2
  exit 0
}

. "$(dirname "$0")/debian-packages.sh"
prepare "nginx for the tests behind a proxy (once, a few seconds)"
# The package would start a server of its own on port 80: an action of 101 forbids that, where nobody has said otherwise.
policy=/usr/sbin/policy-rc.d
if [ ! -e "$policy" ]; then
  printf '#!/bin/sh\nexit 101\n' | $as_root tee "$policy" >/dev/null
  $as_root chmod 755 "$policy"
  trap '$as_root rm -f "$policy"' EXIT
fi
install nginx-light || missing "'apt-get install' failed; its messages are above."
