/* Bytes that arrive become lines. Nothing here knows what a line means. */
#ifndef LINE_H
#define LINE_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol_table.h"

typedef struct {
    char text[LONGEST_REQUEST + 1]; /* ends with 0, without checksum */
    uint8_t error;                  /* 0, or the code of what is wrong with the line itself */
    bool sealed;                    /* it came with a checksum, so its reply gets one */
} line_t;

/* Take one byte in; `lost` where bytes before it were lost. Returns the line that it ends, or 0. */
line_t *line_take(uint8_t byte, bool lost);

#endif
