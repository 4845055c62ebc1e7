#!/bin/sh
# Install what building the strobe controller's firmware and its emulator needs, where that is allowed: as root or with
# sudo that asks nothing, on a system with apt-get. Elsewhere say what to install. Says nothing and is quick where all is
# there.
set -eu

packages="gcc-avr avr-libc simavr libsimavr-dev libelf-dev make gcc"

there() {
    command -v avr-gcc >/dev/null && command -v make >/dev/null && command -v cc >/dev/null &&
        [ -e /usr/include/simavr/sim_avr.h ] && [ -e /usr/include/libelf.h ] &&
        [ -e /usr/lib/avr/include/avr/io.h ]
}

there && exit 0

if ! command -v apt-get >/dev/null; then
    echo "The strobe controller's firmware and emulator need: $packages (names as in Debian). There is no apt-get here:" \
        "install them by the system's own means." >&2
    exit 1
fi
if [ "$(id -u)" = 0 ]; then
    as_root=""
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    as_root="sudo"
else
    echo "The strobe controller's firmware and emulator need Debian packages, and this user may not install them. Run:" \
        "sudo apt-get install $packages" >&2
    exit 1
fi
$as_root apt-get update -qq
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $packages >/dev/null
there || {
    echo "apt-get installed $packages, but the tools are still not found." >&2
    exit 1
}
