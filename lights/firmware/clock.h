/* The controller's time: Timer1's ticks of 0.5 us, counted in 64 bits from the reset. */
#ifndef CLOCK_H
#define CLOCK_H

#include <stdint.h>

void clock_start(void);

/* Count in the timer's wraps; must be called at least every 32 ms. Returns the time. */
uint64_t clock_now(void);

#endif
