#!/bin/sh
# Install the browser in which the tests open psvideo's page (Debian's chromium), where that is allowed: as root or with
# sudo that asks nothing, on a system with apt-get. Elsewhere say what to install. Says nothing and is quick where it is
# there.
set -eu

packages="chromium"

there() {
    command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null
}

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
