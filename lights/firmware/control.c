#include "control.h"

#include <avr/pgmspace.h>
#include <stdbool.h>

#include "board.h"
#include "clock.h"
#include "player.h"
#include "program.h"

#define START_DELAY (10 * TICKS_PER_MS)

uint8_t control_state = STATE_IDLE;
uint8_t control_fault = FAULT_NONE;

static position_t position;
static uint32_t cycle_ticks, cycles_wanted;
static uint32_t step_start; /* the time's low half: a step is shorter than half its range */
static trim_t trim;
static uint32_t last_poll;

void control_show(uint64_t now) {
#ifdef LED_MASK
    bool blink = (uint32_t)now >> 19 & 1; /* a quarter of a second each */
    if (control_state == STATE_RUNNING) return; /* still on from being armed; and it shares the lights' port */
    if (control_state == STATE_ARMED || (control_state == STATE_FAULT && blink)) {
        LED_PORT |= LED_MASK;
    } else {
        LED_PORT &= ~LED_MASK;
    }
#else
    (void)now;
#endif
}

void control_arm(uint32_t ticks) {
    cycle_ticks = ticks;
    control_state = STATE_ARMED;
}

uint64_t control_run(uint32_t cycles) {
    uint64_t now = clock_now();
    position = (position_t){0};
    cycles_wanted = cycles;
    last_poll = now;
    step_start = now + START_DELAY;
    trim_start(&trim, program_parts());
    control_state = STATE_RUNNING;
    player_start(now, START_DELAY, cycles);
    return now + START_DELAY;
}

void control_poll(uint64_t now) {
    if (control_state != STATE_RUNNING) return;
    last_poll = now;
    for (;;) {
        uint32_t length = program_step_ticks(position.step) + trim_extra(&trim);
        if ((int32_t)(last_poll - step_start - length) < 0) return;
        step_start += length;
        trim_pass(&trim);
        if (++position.step < program_step_count) continue;
        position.step = 0;
        position.cycle = ++position.cycles;
        if (position.cycle == cycles_wanted) {
            player_stop();
            control_state = STATE_IDLE;
            return;
        }
    }
}

uint8_t control_trim(bool sooner, uint32_t ppm, const char **reason) {
    share_t share;
    if ((int32_t)(trim.step - trim.from) < 0) return *reason = PSTR("the trim before does not count yet"), ERROR_STATE;
    uint8_t code = program_share(cycle_ticks, sooner, ppm, &share, reason);
    if (code) return code;
    do control_poll(clock_now());
    while (player_is_beyond(trim.step));
    trim_set(&trim, share, trim.step + 2);
    player_trim(share, trim.from);
    return 0;
}

void control_stop(void) {
    player_stop();
    if (control_state != STATE_FAULT) control_state = STATE_IDLE;
}

void control_fail(uint8_t fault) {
    player_stop();
    control_fault = fault;
    control_state = STATE_FAULT;
}

void control_clear(void) {
    control_fault = FAULT_NONE;
    control_state = STATE_IDLE;
}

position_t control_position(void) {
    return position;
}
