#include "clock.h"

#include <avr/io.h>
#include <util/atomic.h>

static uint64_t wraps; /* in ticks: the timer's whole turns so far */
static uint16_t last;

void clock_start(void) {
    TCCR1A = 0;        /* normal mode: it counts on and on, nobody ever writes TCNT1 */
    TCCR1B = 1 << CS11; /* 16 MHz / 8 */
}

uint64_t clock_now(void) {
    uint16_t now;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { /* the edges' interrupts use the same register for the high byte */
        now = TCNT1;
    }
    if (now < last) wraps += 0x10000;
    last = now;
    return wraps | now;
}
