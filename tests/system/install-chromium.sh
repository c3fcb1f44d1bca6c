#!/bin/sh
# Installs Debian's Chromium for the browser tests and `foveacam bench console`, and where Debian has it the headless
# shell, in which the tests take three quarters of the time. Does nothing when both are there.
set -eu

if [ -x /usr/bin/chromium ] && [ -x /usr/bin/chromium-headless-shell ]; then
  exit 0
fi
have_browser() { [ -x /usr/bin/chromium ]; }

missing() {
  have_browser && exit 0
  echo "Chromium is needed for the browser tests and could not be installed here: $1" >&2
  echo "Install it by hand (Debian, Ubuntu: 'apt-get install chromium'), or leave the browser tests out: pytest -m 'not browser'." >&2
  exit 1
}

. "$(dirname "$0")/debian-packages.sh"
prepare "Chromium for the browser tests (once, about a minute)"
install chromium chromium-headless-shell fonts-dejavu-core || install chromium fonts-dejavu-core ||
  missing "'apt-get install chromium' failed; its messages are above."
have_browser || missing "the package was installed, but /usr/bin/chromium is not there."
