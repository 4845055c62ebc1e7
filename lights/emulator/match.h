/* Timer 1's compare outputs as the silicon has them; see board.h for what is put right. */
#ifndef MATCH_H
#define MATCH_H

#include <simavr/sim_avr.h>
#include <stdbool.h>
#include <stdint.h>

typedef void (*pins_changed)(uint64_t cycle);

void match_open(avr_t *chip, int outputs, pins_changed changed);
void match_after_reset(void);
/* True where the timer, not PORT, drives output n. */
bool match_connected(int n);
int match_latch(int n);
/* True once after each change of what drives the pins. */
bool match_connection_changed(void);

#endif
