#include "clock.h"

#include <util/atomic.h>

#include "board.h"

static uint64_t wraps; /* in ticks: the timer's whole turns so far */
static uint16_t last;

void clock_start(void) {
    TIMER_MODE = 0;        /* normal mode: it counts on and on, nobody ever writes its count */
    TIMER_SPEED = 1 << CS11; /* 16 MHz / 8 */
}

uint64_t clock_now(void) {
    uint16_t now;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { /* the edges' interrupts use the same register for the high byte */
        now = TIMER_COUNT;
    }
    if (now < last) wraps += 0x10000;
    last = now;
    return wraps | now;
}
