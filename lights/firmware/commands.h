/* What a line means, and what is answered. */
#ifndef COMMANDS_H
#define COMMANDS_H

#include <stdint.h>

#include "line.h"

/* Act on a line that ended at `now`, and leave the reply ready to be sent. */
void commands_answer(line_t *line, uint64_t now);

#endif
