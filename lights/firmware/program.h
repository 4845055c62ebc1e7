/* What has been uploaded: slots and the steps of the cycle, and what they may be. Numbers are ticks. */
#ifndef PROGRAM_H
#define PROGRAM_H

#include <stdbool.h>
#include <stdint.h>

#include "board.h"
#include "trim.h"

#define MAX_FLASH (MAX_FLASH_US * TICKS_PER_US)
#define MAX_PERIOD MAX_FLASH
#define MIN_DARK (MIN_DARK_US * TICKS_PER_US)
#define MIN_ON (MIN_ON_US * TICKS_PER_US)
#define MIN_OFF (MIN_OFF_US * TICKS_PER_US)
#define MAX_CYCLE (MAX_CYCLE_S * 1000 * TICKS_PER_MS)

/* What one exact output does in a flash, worked out at the upload so that the player need not. */
typedef struct {
    uint32_t on, off;  /* of every burst but the last; 0 and unused where the output stays dark */
    uint32_t last;     /* the last burst's on, which the flash's end may cut */
    uint32_t rest;     /* from the last burst's end, or the flash's start where dark, to the next step */
    uint16_t bursts;   /* 0: stays dark */
} part_t;

typedef struct {
    uint32_t duration, dark, period; /* duration 0: nothing was uploaded here */
    part_t part[EXACT_OUTPUTS];      /* with gated wiring only the first, for all lines that are lit */
    uint8_t lit;                     /* a bit per line */
} slot_t;

/* Which wiring, and what was uploaded; only commands.c writes through the functions below. */
extern uint8_t program_wiring;
extern slot_t program_slots[SLOTS];
extern uint8_t program_steps[STEPS];
extern uint8_t program_step_count;

uint8_t program_lines(void);

/* Forget slots and steps. */
void program_forget(void);

/* A SLOT line's numbers as they came. */
#define MOST_LIT 8
typedef struct {
    uint32_t place, duration, dark, period;
    uint32_t line[MOST_LIT], on[MOST_LIT];
    uint8_t count;
    bool too_many; /* more lines than there are: one is named twice, or out of range */
} upload_t;

/* Take a slot in. Returns 0 or the error's code, and what was wrong. */
uint8_t program_set_slot(const upload_t *upload, const char **reason_in_flash);

/* May the cycle be played? `cycle` becomes its length. Returns as above. */
uint8_t program_check(uint32_t check, uint32_t *cycle, const char **reason_in_flash);

/* How long a step is as uploaded. */
uint32_t program_step_ticks(uint8_t step);

/* Into how many parts a tick is cut, so that every step's share of a trim is a whole number of them. */
uint32_t program_parts(void);

/* What a trim by so many ppm is for a step of a cycle that lasts `cycle`. Returns as above. */
uint8_t program_share(uint32_t cycle, bool sooner, uint32_t ppm, share_t *share, const char **reason_in_flash);

#endif
