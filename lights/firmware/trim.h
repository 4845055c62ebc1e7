/* How much longer than uploaded every step is: one arithmetic for the player, which makes the edges, and for control,
 * which follows them. A share of a tick is carried on, so nothing is lost. */
#ifndef TRIM_H
#define TRIM_H

#include <stdint.h>

/* A step's share: whole ticks (rounded down), and what is left, in parts of a tick. */
typedef struct {
    int32_t whole;
    uint32_t rest;
} share_t;

typedef struct {
    share_t now, next;  /* `next` counts from the step `from` on */
    uint32_t from, step; /* steps are counted from the run's start; `step` is the one that comes */
    uint32_t parts;     /* of a tick; a share's rest and what is carried are less */
    uint32_t carried;
} trim_t;

void trim_start(trim_t *trim, uint32_t parts);
void trim_set(trim_t *trim, share_t share, uint32_t from);

/* By how many ticks the step that comes is longer. */
int32_t trim_extra(const trim_t *trim);

/* Go on to the step behind it. */
void trim_pass(trim_t *trim);

#endif
