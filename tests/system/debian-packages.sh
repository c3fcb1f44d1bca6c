# Installs packages of Debian, as root or by sudo. Read by the scripts beside it, which define `missing REASON`: it says
# what cannot be done without them, and ends the script.

as_root=""

# prepare WHAT: ready to install it, whose name and duration are told.
prepare() {
  command -v apt-get >/dev/null || missing "this machine has no apt-get."
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || missing "apt-get needs root, and there is no sudo."
    as_root="sudo"
  fi
  echo "Installing $1 ..."
  $as_root apt-get update -qq || missing "'apt-get update' failed; is the network up?"
}

install() {
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}
