#include "control.h"

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
static uint32_t cycle_start; /* the time's low half: a cycle is shorter than half its range */
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
    cycle_start = now + START_DELAY;
    control_state = STATE_RUNNING;
    player_start(now, START_DELAY, cycles);
    return now + START_DELAY;
}

static void find_step(void) {
    int32_t since = last_poll - cycle_start;
    position.step = since < 0 ? 0 : program_step_at(since);
}

void control_poll(uint64_t now) {
    if (control_state != STATE_RUNNING) return;
    last_poll = now;
    while ((int32_t)(last_poll - cycle_start - cycle_ticks) >= 0) {
        cycle_start += cycle_ticks;
        position.cycle = ++position.cycles;
        if (position.cycle == cycles_wanted) {
            player_stop();
            position.step = 0;
            control_state = STATE_IDLE;
            return;
        }
    }
}

static void darken(void) {
    player_stop();
    if (control_state == STATE_RUNNING) find_step();
}

void control_stop(void) {
    darken();
    if (control_state != STATE_FAULT) control_state = STATE_IDLE;
}

void control_fail(uint8_t fault) {
    darken();
    control_fault = fault;
    control_state = STATE_FAULT;
}

void control_clear(void) {
    control_fault = FAULT_NONE;
    control_state = STATE_IDLE;
}

position_t control_position(void) {
    if (control_state == STATE_RUNNING) find_step();
    return position;
}
