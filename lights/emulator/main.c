/* Run the strobe controller's firmware in an emulated ATmega328P or ATmega2560. See README.md beside this file. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <getopt.h>
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "board.h"
#include "port.h"
#include "script.h"
#include "trace.h"

#define LOOK_EVERY 1400        /* cycles between looks at the port: about a byte */
#define BOOTS_WITHIN 8000000   /* cycles until the port is announced even if the firmware does not listen */
#define FORGIVE_NS 20000000ll  /* virtual time that lags further behind is not made up for */

static const char USAGE[] =
    "emulator --board atmega328p|atmega2560 [--wiring gated|direct] [--trace FILE] [--fast] [--script FILE|-] FIRMWARE.elf\n";

typedef struct {
    const char *board, *wiring, *trace, *script, *elf;
    bool fast;
} wishes;

static void stop(int signal) {
    (void)signal;
    script_stopped = 1;
}

static void say_reset(const char *cause) {
    fprintf(stderr, "emulator: %s reset at cycle %" PRIu64 "\n", cause, board_cycle());
}

static int64_t wall_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000000ll + now.tv_nsec;
}

static int64_t virtual_ns(void) { return (int64_t)(board_cycle() * (1000000000ull / (CPU_HZ / 1000)) / 1000); }

/* Sleep until the wall clock has come as far as the board's. What a busy machine lost stays lost, so that the board
 * never hurries. */
static void keep_pace(int64_t *ahead_ns) {
    int64_t early = virtual_ns() + *ahead_ns - wall_ns();
    if (early < -FORGIVE_NS) *ahead_ns -= early;
    if (early < 20000) return; /* the system cannot sleep for less */
    struct timespec pause = {.tv_sec = early / 1000000000, .tv_nsec = early % 1000000000};
    nanosleep(&pause, NULL);
}

/* Commands for the outside of the board (open, close, hang, reset) come on stdin, line by line; its end stops. */
static void listen_to_stdin(void) {
    static char line[64];
    static size_t length;
    char byte;
    ssize_t got;
    while ((got = read(STDIN_FILENO, &byte, 1)) == 1) {
        if (byte != '\n') {
            if (length < sizeof line - 1) line[length++] = byte;
            continue;
        }
        line[length] = 0;
        length = 0;
        if (*line && !script_act(line)) fprintf(stderr, "emulator: %s? Say open, close, hang or reset.\n", line);
    }
    if (got == 0) script_stopped = 1;
}

static bool serve(bool fast) {
    const char *name = port_open();
    if (!name) {
        fprintf(stderr, "emulator: no pseudo-terminal to be had (%s).\n", strerror(errno));
        return false;
    }
    while (!board_listens() && board_cycle() < BOOTS_WITHIN && board_step()) continue;
    printf("%s\n", name);
    fflush(stdout);
    fcntl(STDIN_FILENO, F_SETFL, fcntl(STDIN_FILENO, F_GETFL) | O_NONBLOCK);
    uint64_t look = 0;
    int64_t ahead_ns = wall_ns() - virtual_ns();
    while (!script_stopped && board_step()) {
        if (board_cycle() < look) continue;
        look = board_cycle() + LOOK_EVERY;
        port_poll();
        listen_to_stdin();
        if (!fast) keep_pace(&ahead_ns);
    }
    if (!script_stopped) fprintf(stderr, "emulator: the chip stopped at cycle %" PRIu64 ".\n", board_cycle());
    return script_stopped;
}

static bool play(const char *name) {
    FILE *script = strcmp(name, "-") ? fopen(name, "r") : stdin;
    if (!script) {
        fprintf(stderr, "emulator: %s: %s\n", name, strerror(errno));
        return false;
    }
    return script_play(script);
}

static wishes read_wishes(int count, char **words) {
    static const struct option OPTIONS[] = {
        {"board", required_argument, NULL, 'b'}, {"wiring", required_argument, NULL, 'w'},
        {"trace", required_argument, NULL, 't'}, {"script", required_argument, NULL, 's'},
        {"fast", no_argument, NULL, 'f'},        {NULL, 0, NULL, 0},
    };
    wishes wish = {.board = "atmega328p", .wiring = "gated"};
    for (int option; (option = getopt_long(count, words, "", OPTIONS, NULL)) != -1;) {
        if (option == 'b') wish.board = optarg;
        else if (option == 'w') wish.wiring = optarg;
        else if (option == 't') wish.trace = optarg;
        else if (option == 's') wish.script = optarg;
        else if (option == 'f') wish.fast = true;
        else exit(2);
    }
    bool known_wiring = !strcmp(wish.wiring, "gated") || !strcmp(wish.wiring, "direct");
    if (optind + 1 != count || !known_wiring) {
        fputs(USAGE, stderr);
        exit(2);
    }
    wish.elf = words[optind];
    return wish;
}

int main(int count, char **words) {
    wishes wish = read_wishes(count, words);
    if (!trace_open(wish.trace, wish.board, CPU_HZ, wish.wiring)) {
        fprintf(stderr, "emulator: %s: %s\n", wish.trace, strerror(errno));
        return 1;
    }
    struct sigaction on_stop = {.sa_handler = stop};
    sigaction(SIGTERM, &on_stop, NULL);
    sigaction(SIGINT, &on_stop, NULL);
    bool gated = !strcmp(wish.wiring, "gated");
    if (!board_open(wish.board, wish.elf, gated, wish.script ? script_received : port_send,
                    wish.script ? script_reset : say_reset))
        return 1;
    bool done = wish.script ? play(wish.script) : serve(wish.fast);
    board_power_off();
    if (!trace_close()) {
        fprintf(stderr, "emulator: %s could not be written whole.\n", wish.trace);
        return 1;
    }
    return done ? 0 : 1;
}
