#!/bin/sh
# Install what the tests look at psvideo's work with, where that is allowed:
# - the browser in which they open psvideo's page (Debian's chromium), as root or with sudo that asks nothing, on a system
#   with apt-get; elsewhere say what to install;
# - three.js and MicroPython beside tests/clients/package.json, where npm is there; elsewhere their tests are skipped.
# Says nothing and is quick where all is there.
set -eu
cd "$(dirname "$0")"

packages="chromium"
three="clients/node_modules/three/package.json"
micropython="clients/node_modules/@micropython/micropython-webassembly-pyscript/package.json"

there() {
    command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null
}

if { [ ! -e "$three" ] || [ ! -e "$micropython" ]; } && command -v npm >/dev/null; then
    npm install --prefix clients --silent --no-audit --no-fund --no-package-lock --fetch-retries 1 \
        --fetch-retry-mintimeout 2000 --fetch-retry-maxtimeout 5000 >/dev/null 2>&1 ||
        echo "npm cannot install three.js and MicroPython: the tests that use them are skipped." >&2
fi

there && exit 0

if ! command -v apt-get >/dev/null; then
    echo "The tests of psvideo view need a Chromium browser. There is no apt-get here: install it by the system's own" \
        "means." >&2
    exit 1
fi
if [ "$(id -u)" = 0 ]; then
    as_root=""
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    as_root="sudo"
else
    echo "The tests of psvideo view need a Chromium browser, and this user may not install it. Run:" \
        "sudo apt-get install $packages" >&2
    exit 1
fi
$as_root apt-get update -qq
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $packages >/dev/null
there || {
    echo "apt-get installed $packages, but no browser is found." >&2
    exit 1
}
