#!/bin/sh
# Installs Debian's Chromium for the browser tests and `foveacam bench console`, and where Debian has it the headless
# shell, in which the tests take three quarters of the time. Does nothing when both are there.
set -eu

if [ -x /usr/bin/chromium ] && [ -x /usr/bin/chromium-headless-shell ]; then
  exit 0
fi
have_browser() { [ -x /usr/bin/chromium ]; }

explain() {
  have_browser && exit 0
  echo "Chromium is needed for the browser tests and could not be installed here: $1" >&2
  echo "Install it by hand (Debian, Ubuntu: 'apt-get install chromium'), or leave the browser tests out: pytest -m 'not browser'." >&2
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
install() { $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null; }
install chromium chromium-headless-shell fonts-dejavu-core || install chromium fonts-dejavu-core ||
  explain "'apt-get install chromium' failed; its messages are above."
have_browser || explain "the package was installed, but /usr/bin/chromium is not there."
