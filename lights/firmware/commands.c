#include "commands.h"

#include <avr/eeprom.h>
#include <avr/pgmspace.h>
#include <ctype.h>
#include <string.h>

#include "board.h"
#include "clock.h"
#include "control.h"
#include "player.h"
#include "program.h"
#include "reply.h"
#include "safety.h"
#include "words.h"
#ifdef TEST_HANG
#include "hang.h"
#endif

#define FIRMWARE "1.0"
#define UNIT_LENGTH 8

static const char state_names[] PROGMEM = STATE_NAMES;
static const char fault_names[] PROGMEM = FAULT_NAMES;
static const char reset_names[] PROGMEM = RESET_NAMES;
static const char wiring_names[] PROGMEM = WIRING_NAMES;
static const char way_names[] PROGMEM = WAY_NAMES;
static const char interlock_names[] PROGMEM = "closed open";

static uint64_t line_time;

static bool refuse_number(const char *word, uint32_t *value) {
    if (words_number(word, value)) return false;
    reply_error(ERROR_NUMBER, PSTR("number"));
    return true;
}

/* A name that its owner may write into the first bytes of the EEPROM, to distinguish boards. */
static void read_unit(char name[UNIT_LENGTH + 1]) {
    uint8_t length = 0;
    for (; length < UNIT_LENGTH; length++) {
        name[length] = eeprom_read_byte((const uint8_t *)(uint16_t)length);
        if (!isalnum((uint8_t)name[length])) break;
    }
    name[length] = 0;
    if (!length) strcpy_P(name, PSTR("unnamed"));
}

static void answer_ID(const char *keys) {
    char unit[UNIT_LENGTH + 1];
    read_unit(unit);
    reply_ok(keys);
    reply_number(PROTOCOL);
    reply_flash_text(PSTR(BOARD_NAME));
    reply_flash_text(PSTR(FIRMWARE));
    reply_text(unit);
}

static void answer_CAPS(const char *keys) {
    reply_ok(keys);
    reply_number(TICK_PS);
    reply_word(wiring_names, program_wiring);
    reply_number(program_lines());
    reply_number(program_wiring == WIRING_GATED ? POWERS_GATED : POWERS_DIRECT);
    reply_number(SLOTS);
    reply_number(STEPS);
    reply_number(MIN_ON);
    reply_number(MIN_OFF);
    reply_number(MIN_DARK);
    reply_number(MAX_FLASH);
    reply_number(MAX_PERIOD);
    reply_number(MAX_LINE_PPM);
    reply_number(MAX_TOTAL_PPM);
    reply_number(TOLERANCE_PPM);
    reply_number(safety_keep_ms);
}

static void answer_WIRING(const char *keys) {
    int8_t wiring = words_find(words_next(), wiring_names);
    if (wiring < 0) {
        reply_error(ERROR_NUMBER, PSTR("wiring"));
        return;
    }
    program_wiring = wiring;
    program_forget();
    reply_ok(keys);
    reply_word(wiring_names, wiring);
}

static void answer_KEEP(const char *keys) {
    uint32_t ms;
    if (refuse_number(words_next(), &ms)) return;
    if (ms < LEAST_KEEP_MS || ms > MOST_KEEP_MS) {
        reply_error(ERROR_RANGE, PSTR("ms"));
        return;
    }
    safety_keep_ms = ms;
    reply_ok(keys);
    reply_number(ms);
}

static void answer_NEW(const char *keys) {
    program_forget();
    control_stop();
    reply_ok(keys);
}

static bool refuse_upload(upload_t *upload, uint8_t lines) {
    uint32_t line, on;
    if (refuse_number(words_next(), &upload->place) || refuse_number(words_next(), &upload->duration) ||
        refuse_number(words_next(), &upload->dark) || refuse_number(words_next(), &upload->period)) {
        return true;
    }
    upload->count = 0;
    upload->too_many = lines > MOST_LIT;
    for (; lines; lines--) {
        if (!words_pair(words_next(), &line, &on)) {
            reply_error(ERROR_NUMBER, PSTR("line:on"));
            return true;
        }
        if (upload->count == MOST_LIT) continue;
        upload->line[upload->count] = line;
        upload->on[upload->count++] = on;
    }
    return false;
}

static uint8_t words_behind; /* how many words stand behind the command's name */

static void answer_SLOT(const char *keys) {
    upload_t upload;
    const char *reason;
    if (refuse_upload(&upload, words_behind - 4)) return;
    uint8_t code = program_set_slot(&upload, &reason);
    if (code) {
        reply_error(code, reason);
        return;
    }
    reply_ok(keys);
    reply_number(upload.place);
}

static void answer_STEPS(const char *keys) {
    static uint8_t slots[LONGEST_REQUEST / 2];
    uint32_t first, slot;
    uint8_t count = words_behind - 1;
    bool wrong = false;
    if (refuse_number(words_next(), &first)) return;
    for (uint8_t place = 0; place < count; place++) {
        if (refuse_number(words_next(), &slot)) return;
        if (slot >= SLOTS) wrong = true;
        slots[place] = slot;
    }
    if (first > program_step_count || first + count > STEPS) {
        reply_error(ERROR_RANGE, PSTR("first, or too many steps"));
    } else if (wrong) {
        reply_error(ERROR_RANGE, PSTR("slot"));
    } else {
        memcpy(program_steps + first, slots, count);
        program_step_count = first + count;
        reply_ok(keys);
        reply_number(program_step_count);
    }
}

static void answer_ARM(const char *keys) {
    uint32_t check, cycle;
    const char *reason;
    if (refuse_number(words_next(), &check)) return;
    uint8_t code = program_check(check, &cycle, &reason);
    if (code) {
        reply_error(code, reason);
    } else if (safety_is_interlock_open()) {
        reply_error(ERROR_INTERLOCK, PSTR("interlock open"));
    } else {
        control_arm(cycle);
        reply_ok(keys);
        reply_number(check);
        reply_number(cycle);
    }
}

static void answer_RUN(const char *keys) {
    uint32_t cycles;
    if (refuse_number(words_next(), &cycles)) return;
    uint64_t start = control_run(cycles);
    reply_ok(keys);
    reply_long_number(start);
}

static void answer_TRIM(const char *keys) {
    uint32_t ppm;
    const char *reason;
    int8_t way = words_find(words_next(), way_names);
    if (way < 0) {
        reply_error(ERROR_NUMBER, PSTR("way"));
        return;
    }
    if (refuse_number(words_next(), &ppm)) return;
    if (ppm > MAX_TRIM_PPM) {
        reply_error(ERROR_RANGE, PSTR("ppm > max_trim_ppm"));
        return;
    }
    uint8_t code = control_trim(way == WAY_SOONER, ppm, &reason);
    if (code) {
        reply_error(code, reason);
        return;
    }
    reply_ok(keys);
    reply_word(way_names, way);
    reply_number(ppm);
}

static void answer_STOP(const char *keys) {
    control_stop();
    reply_ok(keys);
    reply_word(state_names, control_state);
    reply_number(control_position().cycles);
}

static void answer_STAT(const char *keys) {
    position_t position = control_position();
    reply_ok(keys);
    reply_word(state_names, control_state);
    reply_word(fault_names, control_fault);
    reply_word(reset_names, safety_reset_cause());
    reply_word(interlock_names, safety_is_interlock_open());
    reply_number(position.cycle);
    reply_number(position.step);
    reply_number(position.cycles);
}

static bool is_nonce(const char *word) {
    uint8_t length = 0;
    for (; word[length]; length++) {
        if (!isalnum((uint8_t)word[length])) return false;
    }
    return length <= LONGEST_NONCE;
}

static void answer_CLK(const char *keys) {
    char *nonce = words_next();
    if (!is_nonce(nonce)) {
        reply_error(ERROR_NUMBER, PSTR("nonce"));
        return;
    }
    reply_ok(keys);
    reply_text(nonce);
    reply_number(control_position().cycle);
    reply_long_number(line_time);
}

static void answer_CLEAR(const char *keys) {
    if (safety_is_interlock_open()) {
        reply_error(ERROR_INTERLOCK, PSTR("interlock open"));
        return;
    }
    control_clear();
    reply_ok(keys);
    reply_word(state_names, control_state);
}

typedef struct {
    char name[7];
    uint8_t fewest, most, states;
    void (*answer)(const char *keys);
    const char *keys;
} command_t;

#define KEYS_OF(name, fewest, most, states, keys) static const char keys_##name[] PROGMEM = keys;
#define ROW_OF(name, fewest, most, states, keys) {#name, fewest, most, states, answer_##name, keys_##name},
COMMANDS(KEYS_OF)
static const command_t commands[] PROGMEM = {COMMANDS(ROW_OF)};

static bool find_command(const char *name, command_t *command) {
    for (uint8_t place = 0; place < sizeof commands / sizeof *commands; place++) {
        memcpy_P(command, &commands[place], sizeof *command);
        if (strcmp(name, command->name) == 0) return true;
    }
    return false;
}

/* Errors in the order of protocol.md. */
static void answer(line_t *line) {
    command_t command;
    int8_t count = words_cut(line->text);
#ifdef TEST_HANG
    if (strcmp(line->text, "HANG") == 0) hang(words_next());
#endif
    words_behind = count;
    if (!find_command(line->text, &command)) {
        reply_error(ERROR_COMMAND, PSTR("command"));
    } else if (command.states >> control_state & 1) {
        if (count < command.fewest || (uint8_t)count > command.most) {
            reply_error(ERROR_WORDS, PSTR("words"));
        } else {
            command.answer(command.keys);
        }
    } else if (control_state == STATE_FAULT) {
        reply_error_word(ERROR_FAULT, fault_names, control_fault);
    } else {
        reply_error_word(ERROR_STATE, state_names, control_state);
    }
}

void commands_answer(line_t *line, uint64_t now) {
    line_time = now;
    control_poll(now);
    if (line->error == ERROR_BYTES) {
        reply_error(ERROR_BYTES, PSTR("bytes"));
    } else if (line->error == ERROR_LONG) {
        reply_error(ERROR_LONG, PSTR("line too long"));
    } else if (line->error == ERROR_CRC) {
        reply_error(ERROR_CRC, PSTR("checksum"));
    } else {
        answer(line);
    }
    if (!reply_is_error()) safety_heard_host(now);
    reply_end(line->sealed);
}
