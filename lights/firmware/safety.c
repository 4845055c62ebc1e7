#include "safety.h"

#include <avr/io.h>
#include <avr/wdt.h>

#include "board.h"
#include "control.h"
#include "player.h"

#define KEEP_AFTER_RESET_MS 1000
/* Between two visits to the player's long way lie at most a flash of 50 ms in bursts and a piece of 33 ms. */
#define ALIVE_TICKS (100 * TICKS_PER_MS)

uint16_t safety_keep_ms = KEEP_AFTER_RESET_MS;

static uint8_t reset_flags __attribute__((section(".noinit")));
static uint32_t heard, alive, fed;

/* Before anything else runs: after a watchdog reset it is on with its shortest time, and would bite again. */
void safety_at_reset(void) __attribute__((naked, used, section(".init3")));
void safety_at_reset(void) {
    reset_flags = MCUSR;
    MCUSR = 0;
    wdt_enable(WDTO_120MS);
}

uint8_t safety_reset_cause(void) {
    if (reset_flags & 1 << WDRF) return RESET_WATCHDOG;
    if (reset_flags & 1 << BORF) return reset_flags & 1 << PORF ? RESET_POWER : RESET_BROWNOUT;
    if (reset_flags & 1 << PORF) return RESET_POWER;
    return reset_flags & 1 << EXTRF ? RESET_EXTERNAL : RESET_OTHER;
}

bool safety_is_interlock_open(void) {
    return INTERLOCK_PIN & INTERLOCK_MASK;
}

void safety_boot(void) {
    INTERLOCK_PORT |= INTERLOCK_MASK; /* pull-up: a wire that breaks opens it */
#ifdef LED_MASK
    LED_DDR |= LED_MASK;
#endif
    if (safety_reset_cause() == RESET_WATCHDOG) control_fail(FAULT_WATCHDOG);
}

void safety_heard_host(uint64_t now) {
    heard = now;
}

static void watch_lights(uint32_t now) {
    if (control_state == STATE_RUNNING && player_was_late()) {
        control_fail(FAULT_LATE);
    } else if (safety_is_interlock_open()) {
        control_fail(FAULT_INTERLOCK);
    } else if (now - heard > safety_keep_ms * TICKS_PER_MS) {
        control_fail(FAULT_SILENT);
    }
}

/* Only while time goes on, and the player with it. Otherwise the watchdog makes it dark, by its own clock. */
static void feed_watchdog(uint32_t now) {
    if (control_state != STATE_RUNNING || player_is_alive()) alive = now;
    if (now != fed && now - alive <= ALIVE_TICKS) wdt_reset();
    fed = now;
}

void safety_poll(uint64_t now) {
    if (control_state == STATE_ARMED || control_state == STATE_RUNNING) watch_lights(now);
    feed_watchdog(now);
}
