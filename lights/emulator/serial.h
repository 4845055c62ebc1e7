/* UART 0, byte by byte at the line's speed in virtual time; see board.h for what is put right. */
#ifndef SERIAL_H
#define SERIAL_H

#include <simavr/sim_avr.h>

#include "board.h"

void serial_open(avr_t *chip, byte_sink sent);
void serial_after_reset(void);
/* After every instruction: let the byte arrive that is due. */
void serial_step(void);

#endif
