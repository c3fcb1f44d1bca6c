#!/bin/sh
# Installs Debian's nginx, behind which the tests put a server. Does nothing when it is there. Where it cannot be had,
# those tests are skipped and say so.
set -eu

if [ -x /usr/sbin/nginx ] || command -v nginx >/dev/null; then
  exit 0
fi

explain() {
  echo "The tests of a server behind a proxy are skipped: $1" >&2
  echo "They need nginx (Debian, Ubuntu: 'apt-get install nginx-light')." >&2
  exit 0
}

command -v apt-get >/dev/null || explain "this machine has no apt-get."

as_root=""
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || explain "apt-get needs root, and there is no sudo."
  as_root="sudo"
fi

echo "Installing nginx for the tests behind a proxy (once, a few seconds) ..."
$as_root apt-get update -qq || explain "'apt-get update' failed; is the network up?"
# The package would start a server of its own on port 80: an action of 101 forbids that, where nobody has said otherwise.
policy=/usr/sbin/policy-rc.d
if [ ! -e "$policy" ]; then
  printf '#!/bin/sh\nexit 101\n' | $as_root tee "$policy" >/dev/null
  $as_root chmod 755 "$policy"
  trap '$as_root rm -f "$policy"' EXIT
fi
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends nginx-light >/dev/null ||
  explain "'apt-get install' failed; its messages are above."
