/* Plays the uploaded cycle: the timer's compare units make the edges, interrupts only arm the next one. */
#ifndef PLAYER_H
#define PLAYER_H

#include <stdbool.h>
#include <stdint.h>

#include "trim.h"

/* Pins to outputs, all dark. */
void player_boot(void);

/* Begin `ticks` after `from`, which is not long ago; `cycles` 0: until stopped. */
void player_start(uint64_t from, uint32_t ticks, uint32_t cycles);

/* Make the steps from the number `from` on (counted from the run's start) longer by a share. */
void player_trim(share_t share, uint32_t from);

/* Is a step behind `step` being played already? */
bool player_is_beyond(uint32_t step);

/* Dark at once, in the middle of a flash too. */
void player_stop(void);

/* True where an edge could not be armed in time; the player has darkened by then. */
bool player_was_late(void);

/* Have all outputs that still play been served since this was last true? */
bool player_is_alive(void);

#endif
