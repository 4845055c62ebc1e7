/* CRC-16/CCITT-FALSE, and how it stands at a line's end. */
#ifndef CRC_H
#define CRC_H

#include <stdint.h>
#include <util/crc16.h>

#include "protocol_table.h"

#if CHECKSUM_POLYNOMIAL != 0x1021
#error "The table wants another checksum than the one that is computed here."
#endif

#define SEAL_LENGTH 5 /* '*' and four hexadecimal digits */

static inline uint16_t crc_add(uint16_t crc, uint8_t byte) {
    return _crc_xmodem_update(crc, byte); /* what avr-libc calls by this name */
}

/* The checksum of some text as a line's end. */
void crc_seal(const char *text, uint8_t length, char seal[SEAL_LENGTH]);

#endif
