#!/bin/sh
# Installs Debian's Chromium: its headless shell for the browser tests, the browser for `foveacam bench console`.
# Does nothing when both are there.
set -eu

if [ -x /usr/bin/chromium ] && [ -x /usr/bin/chromium-headless-shell ]; then
  exit 0
fi

explain() {
  echo "Chromium is needed for the browser tests and could not be installed here: $1" >&2
  echo "Install it by hand (Debian, Ubuntu: 'apt-get install chromium chromium-headless-shell'), or leave the browser tests out: pytest -m 'not browser'." >&2
  exit 1
}

command -v apt-get >/dev/null || explain "this machine has no apt-get."

as_root=""
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || explain "apt-get needs root, and there is no sudo."
  as_root="sudo"
fi

echo "Installing Chromium for the browser tests (once, about a minute) ..."
$as_root apt-get update -qq || explain "'apt-get update' failed; is the network up?"
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
  chromium chromium-headless-shell fonts-dejavu-core >/dev/null || explain "'apt-get install chromium' failed; its messages are above."
[ -x /usr/bin/chromium-headless-shell ] || explain "the package was installed, but /usr/bin/chromium-headless-shell is not there."
