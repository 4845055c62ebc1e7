#include "script.h"

#include <ctype.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "board.h"
#include "trace.h"

#define LONGEST 4096
#define CYCLES_PER_MS (CPU_HZ / 1000)
#define REPLY_WITHIN_MS 500

volatile int script_stopped;
static char reply[512];
static size_t reply_length;
static unsigned long replies, errors;
static bool is_counting; /* poll and flood count replies instead of printing them */

void script_received(uint8_t byte) {
    if (byte != '\n') {
        if (reply_length < sizeof reply - 1) reply[reply_length++] = isprint(byte) ? (char)byte : '?';
        return;
    }
    reply[reply_length] = 0;
    reply_length = 0;
    replies++;
    errors += reply[0] == 'E';
    if (!is_counting) printf("%" PRIu64 " < %s\n", board_cycle(), reply);
}

void script_reset(const char *cause) {
    reply_length = 0;
    printf("%" PRIu64 " ! %s reset\n", board_cycle(), cause);
}

static bool step(void) { return !script_stopped && board_step(); }

static void wait_until(uint64_t cycle) {
    while (board_cycle() < cycle && step()) continue;
}

static void transmit(const char *text) {
    board_receive((const uint8_t *)text, strlen(text));
    board_receive((const uint8_t *)"\n", 1);
}

/* Send a request and wait for its reply; false where there came none. */
static bool ask(const char *text) {
    unsigned long before = replies;
    transmit(text);
    uint64_t end = board_cycle() + REPLY_WITHIN_MS * CYCLES_PER_MS;
    while (replies == before && board_cycle() < end && step()) continue;
    return replies != before;
}

static void ask_for(uint64_t end, const char *text, bool waits) {
    unsigned long replies_before = replies, errors_before = errors, lost_before = board_lost_bytes();
    is_counting = true;
    while (board_cycle() < end && !script_stopped) {
        if (waits) {
            if (!ask(text)) printf("%" PRIu64 " ! no reply\n", board_cycle());
        } else {
            if (board_on_their_way() < 256) transmit(text);
            if (!step()) break;
        }
    }
    while (board_on_their_way() && step()) continue;
    wait_until(board_cycle() + 20 * CYCLES_PER_MS); /* the last replies */
    is_counting = false;
    printf("%" PRIu64 " = %lu %lu %lu\n", board_cycle(), replies - replies_before, errors - errors_before,
           board_lost_bytes() - lost_before);
}

static bool transmit_hex(const char *digits) {
    unsigned value;
    int used;
    while (sscanf(digits, " %2x%n", &value, &used) == 1) {
        uint8_t byte = (uint8_t)value;
        board_receive(&byte, 1);
        digits += used;
    }
    return !*digits;
}

bool script_act(const char *line) {
    if (!strcmp(line, "open") || !strcmp(line, "close")) board_interlock(!strcmp(line, "open"));
    else if (!strcmp(line, "hang")) board_hang();
    else if (!strcmp(line, "reset")) board_reset();
    else return false;
    return true;
}

static const char *after(const char *line, const char *word) {
    size_t length = strlen(word);
    return !strncmp(line, word, length) && line[length] == ' ' ? line + length + 1 : NULL;
}

static bool obey(const char *line) {
    const char *rest;
    char *text;
    if (!*line || *line == '#' || script_act(line)) return true;
    if ((rest = after(line, "until"))) {
        wait_until(strtoull(rest, &text, 10));
        printf("%" PRIu64 " @\n", board_cycle());
        return text != rest && !*text;
    }
    if ((rest = after(line, "bytes"))) return transmit_hex(rest);
    if ((rest = after(line, "send"))) {
        if (!ask(rest)) printf("%" PRIu64 " ! no reply\n", board_cycle());
        return true;
    }
    bool polls = after(line, "poll"), floods = after(line, "flood");
    if (!(rest = after(line, polls ? "poll" : floods ? "flood" : "wait"))) return false;
    uint64_t end = board_cycle() + (uint64_t)(strtod(rest, &text) * CYCLES_PER_MS);
    if (!polls && !floods) {
        wait_until(end);
        return text != rest && !*text;
    }
    if (text == rest || *text != ' ') return false;
    ask_for(end, text + 1, polls);
    return true;
}

bool script_play(FILE *script) {
    static char line[LONGEST];
    int number = 0;
    while (!script_stopped && fgets(line, sizeof line, script)) {
        number++;
        line[strcspn(line, "\r\n")] = 0;
        if (!obey(line)) {
            fprintf(stderr, "emulator: line %d of the script is %s; expected send, bytes, wait, until, poll, flood, open, close, "
                            "hang or reset as in script.h.\n", number, line);
            return false;
        }
        trace_flush(); /* before the answer: whoever hears that finds every edge */
        fflush(stdout);
    }
    return true;
}
