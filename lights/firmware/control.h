/* The states, and where a run is. */
#ifndef CONTROL_H
#define CONTROL_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t cycle, cycles;
    uint8_t step;
} position_t;

extern uint8_t control_state; /* STATE_... */
extern uint8_t control_fault; /* FAULT_... */

void control_arm(uint32_t cycle_ticks);
/* Returns the time of the first flash's start. */
uint64_t control_run(uint32_t cycles);
/* Make the steps behind the next one longer or shorter. Returns 0 or the error's code, and what was wrong. */
uint8_t control_trim(bool sooner, uint32_t ppm, const char **reason_in_flash);
/* Dark, and idle unless a fault is latched. */
void control_stop(void);
/* Dark, and in fault until cleared. */
void control_fail(uint8_t fault);
void control_clear(void);

/* Follow the run; it ends here when its last cycle is over. */
void control_poll(uint64_t now);

/* The LED: on while armed or running, so that nobody looks into the lights unwarned; it blinks in fault. */
void control_show(uint64_t now);

position_t control_position(void);

#endif
