#include "program.h"

#include <avr/pgmspace.h>
#include <string.h>

#include "clock.h"
#include "crc.h"

#define LONGEST_DARK 0x7FFFFFFFUL
#define CHECKED_LINES 8
#define PPM 1000000ULL

#define REFUSE(code, text) return *reason = PSTR(text), (code)

uint8_t program_wiring = WIRING_GATED;
slot_t program_slots[SLOTS];
uint8_t program_steps[STEPS];
uint8_t program_step_count;

uint8_t program_lines(void) {
    return program_wiring == WIRING_GATED ? LINES_GATED : LINES_DIRECT;
}

void program_forget(void) {
    memset(program_slots, 0, sizeof program_slots);
    program_step_count = 0;
}

static const slot_t *slot_of(uint8_t step) {
    return &program_slots[program_steps[step]];
}

/* What a line does in a slot, 0 where it is not lit. */
static const part_t *part_of(const slot_t *slot, uint8_t line) {
    return slot->lit >> line & 1 ? &slot->part[program_wiring == WIRING_GATED ? 0 : line] : 0;
}

static uint32_t smaller(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

static uint8_t refuse_times(const upload_t *upload, const char **reason) {
    if (upload->place >= SLOTS) REFUSE(ERROR_RANGE, "slot");
    if (upload->duration > MAX_FLASH) REFUSE(ERROR_LIMIT, "duration > max_flash");
    if (!upload->duration) REFUSE(ERROR_RANGE, "duration 0");
    if (upload->dark < MIN_DARK) REFUSE(ERROR_LIMIT, "dark < min_dark");
    if (upload->dark > LONGEST_DARK) REFUSE(ERROR_RANGE, "dark > 2147483647");
    if (upload->period > upload->duration) REFUSE(ERROR_RANGE, "period > duration");
    if (!upload->period) REFUSE(ERROR_RANGE, "period 0");
    return 0;
}

static uint8_t refuse_lines(const upload_t *upload, const char **reason) {
    uint8_t seen = 0;
    for (uint8_t i = 0; i < upload->count; i++) {
        if (!upload->on[i] || upload->on[i] > upload->period) REFUSE(ERROR_RANGE, "on 0 or > period");
    }
    for (uint8_t i = 0; i < upload->count; i++) {
        if (upload->line[i] >= program_lines()) REFUSE(ERROR_RANGE, "line");
        if (seen >> upload->line[i] & 1) REFUSE(ERROR_RANGE, "line twice");
        seen |= 1 << upload->line[i];
    }
    if (upload->too_many) REFUSE(ERROR_RANGE, "line twice");
    return 0;
}

static uint8_t refuse_bursts(const upload_t *upload, const char **reason) {
    uint32_t rest = upload->duration % upload->period;
    for (uint8_t i = 0; i < upload->count; i++) {
        uint32_t on = upload->on[i];
        if (on < MIN_ON) REFUSE(ERROR_LIMIT, "on < min_on");
        if (rest && rest < MIN_ON) REFUSE(ERROR_LIMIT, "last burst < min_on");
        if (on < upload->period && upload->period - on < MIN_OFF) REFUSE(ERROR_LIMIT, "period - on < min_off");
    }
    for (uint8_t i = 1; i < upload->count && program_wiring == WIRING_GATED; i++) {
        if (upload->on[i] != upload->on[0]) REFUSE(ERROR_POWERS, "powers differ");
    }
    return 0;
}

static part_t make_part(const slot_t *slot, uint32_t on) {
    part_t part = {.on = on, .off = slot->period - on, .bursts = 1, .last = slot->duration, .rest = slot->dark};
    if (on == slot->period) return part; /* full power: one long burst */
    part.bursts = (slot->duration - 1) / slot->period + 1;
    uint32_t room = slot->duration - (part.bursts - 1) * slot->period;
    part.last = smaller(on, room);
    part.rest += room - part.last;
    return part;
}

static void store(const upload_t *upload) {
    slot_t *slot = &program_slots[upload->place];
    memset(slot, 0, sizeof *slot);
    slot->duration = upload->duration;
    slot->dark = upload->dark;
    slot->period = upload->period;
    for (uint8_t output = 0; output < EXACT_OUTPUTS; output++) slot->part[output].rest = slot->duration + slot->dark;
    for (uint8_t i = 0; i < upload->count; i++) {
        slot->lit |= 1 << upload->line[i];
        slot->part[program_wiring == WIRING_GATED ? 0 : upload->line[i]] = make_part(slot, upload->on[i]);
    }
}

uint8_t program_set_slot(const upload_t *upload, const char **reason) {
    uint8_t code;
    if ((code = refuse_times(upload, reason))) return code;
    if ((code = refuse_lines(upload, reason))) return code;
    if ((code = refuse_bursts(upload, reason))) return code;
    store(upload);
    return 0;
}

static uint32_t lit_ticks(const part_t *part) {
    return part ? (part->bursts - 1) * part->on + part->last : 0;
}

static uint16_t add_number(uint16_t crc, uint32_t number) {
    for (uint8_t byte = 0; byte < 4; byte++, number >>= 8) crc = crc_add(crc, number);
    return crc;
}

static uint16_t add_slot(uint16_t crc, const slot_t *slot) {
    crc = add_number(crc, slot->duration);
    crc = add_number(crc, slot->dark);
    crc = add_number(crc, slot->period);
    for (uint8_t line = 0; line < CHECKED_LINES; line++) {
        const part_t *part = part_of(slot, line);
        crc = add_number(crc, part ? part->on : 0);
    }
    return crc;
}

static uint16_t check_of_cycle(void) {
    uint16_t crc = CHECKSUM_START;
    for (uint8_t step = 0; step < program_step_count; step++) {
        crc = add_slot(crc, slot_of(step));
        clock_now(); /* all steps together take longer than a turn of the timer may */
    }
    return crc;
}

/* Sums fit 32 bits: at most 240 steps of at most 100,000 lit ticks on each of 8 lines. */
static bool is_share_above(uint32_t lit, uint64_t cycle, uint32_t limit_ppm) {
    return lit * PPM >= (limit_ppm + 1) * cycle; /* the share is rounded down before it is compared */
}

static uint8_t refuse_shares(uint64_t cycle, const char **reason) {
    uint32_t total = 0;
    for (uint8_t line = 0; line < program_lines(); line++) {
        uint32_t lit = 0;
        for (uint8_t step = 0; step < program_step_count; step++) {
            lit += lit_ticks(part_of(slot_of(step), line));
        }
        if (is_share_above(lit, cycle, MAX_LINE_PPM)) REFUSE(ERROR_LIMIT, "a line's share > max_line_ppm");
        total += lit;
        clock_now();
    }
    if (is_share_above(total, cycle, MAX_TOTAL_PPM)) REFUSE(ERROR_LIMIT, "total share > max_total_ppm");
    return 0;
}

uint8_t program_check(uint32_t check, uint32_t *cycle, const char **reason) {
    uint64_t ticks = 0;
    uint8_t code;
    if (!program_step_count) REFUSE(ERROR_INCOMPLETE, "no steps");
    for (uint8_t step = 0; step < program_step_count; step++) {
        if (!slot_of(step)->duration) REFUSE(ERROR_INCOMPLETE, "a step names an empty slot");
        ticks += slot_of(step)->duration;
        ticks += slot_of(step)->dark;
    }
    if (check != check_of_cycle()) REFUSE(ERROR_CHECK, "check");
    if ((code = refuse_shares(ticks, reason))) return code;
    if (ticks > MAX_CYCLE) REFUSE(ERROR_LIMIT, "cycle > max_cycle");
    *cycle = ticks;
    return 0;
}

uint32_t program_step_ticks(uint8_t step) {
    return slot_of(step)->duration + slot_of(step)->dark;
}

uint32_t program_parts(void) {
    return (uint32_t)PPM * program_step_count;
}

uint8_t program_share(uint32_t cycle, bool sooner, uint32_t ppm, share_t *share, const char **reason) {
    uint8_t code;
    uint64_t moved = (uint64_t)cycle * ppm; /* in parts, of a whole cycle's steps together */
    uint32_t parts = program_parts(), ticks = moved / PPM + 1;
    share->whole = moved / parts;
    share->rest = moved % parts;
    if (sooner) {
        share->whole = -share->whole;
        if (share->rest) {
            share->whole--;
            share->rest = parts - share->rest;
        }
    }
    for (uint8_t step = 0; step < program_step_count; step++) {
        if ((int32_t)(slot_of(step)->dark + share->whole - 2 * MIN_DARK) < 0) REFUSE(ERROR_LIMIT, "dark < 2 min_dark");
    }
    if (sooner) {
        if ((code = refuse_shares(cycle - ticks, reason))) return code;
    } else if (cycle + ticks > MAX_CYCLE) {
        REFUSE(ERROR_LIMIT, "cycle > max_cycle");
    }
    return 0;
}
