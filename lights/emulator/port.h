/* The board's serial line as a pseudo-terminal that a host opens like any serial port. */
#ifndef PORT_H
#define PORT_H

#include <stdbool.h>
#include <stdint.h>

/* Make the pseudo-terminal; returns its name, or NULL (errno says why). */
const char *port_open(void);
/* Hand what the host wrote to the board. */
void port_poll(void);
/* Hand a byte of the board to the host; lost where nobody reads, as on a wire. */
void port_send(uint8_t byte);

#endif
