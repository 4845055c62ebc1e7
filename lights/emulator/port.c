#define _GNU_SOURCE
#include "port.h"

#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include "board.h"

static int host = -1;
static int ours = -1; /* the host's side, held open so that a host may come and go */
static uint8_t waiting[512];
static size_t waiting_count;

const char *port_open(void) {
    host = posix_openpt(O_RDWR | O_NOCTTY);
    if (host < 0 || grantpt(host) || unlockpt(host)) return NULL;
    const char *name = ptsname(host);
    ours = name ? open(name, O_RDWR | O_NOCTTY) : -1;
    struct termios raw;
    if (ours < 0 || tcgetattr(ours, &raw)) return NULL;
    cfmakeraw(&raw);
    cfsetspeed(&raw, B115200);
    if (tcsetattr(ours, TCSANOW, &raw) || fcntl(host, F_SETFL, O_NONBLOCK) < 0) return NULL;
    return name;
}

void port_poll(void) {
    if (!waiting_count) {
        ssize_t got = read(host, waiting, sizeof waiting);
        waiting_count = got > 0 ? (size_t)got : 0;
    }
    if (!waiting_count) return;
    size_t taken = board_receive(waiting, waiting_count);
    for (size_t n = taken; n < waiting_count; n++) waiting[n - taken] = waiting[n];
    waiting_count -= taken;
}

void port_send(uint8_t byte) {
    if (host >= 0 && write(host, &byte, 1) < 0) return;
}
