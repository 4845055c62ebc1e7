/* What drives a board without a port: lines of commands, read from a file or stdin.
 *
 *   send TEXT         a request; goes on when its reply is there, or after half a second without one
 *   bytes HEX         bytes as they are; does not wait
 *   wait MS           let virtual milliseconds pass
 *   poll MS TEXT      the request again and again for so long, each after the reply to the one before
 *   flood MS TEXT     the same without waiting for replies: the line is never quiet
 *   until CYCLE       let virtual time pass until a CPU cycle, and print "CYCLE @" once the trace has its edges
 *   open, close       the interlock's contact
 *   hang              the program gets stuck
 *   reset             somebody presses the reset button
 *
 * Empty lines and lines that start with # say nothing. Printed on stdout, behind the CPU cycle: "< reply",
 * "! watchdog reset", "! no reply", and after poll and flood "= replies errors bytes lost by the receiver".
 */
#ifndef SCRIPT_H
#define SCRIPT_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/* Play the script to its end. False where it holds a line that is none of the above. */
bool script_play(FILE *script);
/* A command that needs no reply (open, close, hang, reset). False where it is none. */
bool script_act(const char *line);
void script_received(uint8_t byte);
void script_reset(const char *cause);
/* Set from a signal: stop soon. */
extern volatile int script_stopped;

#endif
