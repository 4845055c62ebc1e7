#include "line.h"

#include <string.h>

#include "crc.h"

static line_t line;
static uint8_t length;
static bool bad, too_long, carriage_return, star;

/* Cut the checksum off. A '*' is nothing but the beginning of one, so a '*' elsewhere is wrong. */
static bool unseal(void) {
    char seal[SEAL_LENGTH];
    if (length < SEAL_LENGTH) return false;
    length -= SEAL_LENGTH;
    crc_seal(line.text, length, seal);
    if (memcmp(line.text + length, seal, SEAL_LENGTH) != 0) return false;
    line.text[length] = 0;
    return memchr(line.text, '*', length) == 0;
}

static line_t *end_line(void) {
    bool empty = !length && !bad && !too_long;
    line.text[length] = 0;
    line.sealed = star;
    line.error = bad ? ERROR_BYTES : too_long ? ERROR_LONG : star && !unseal() ? ERROR_CRC : 0;
    length = 0;
    bad = too_long = carriage_return = star = false;
    return empty ? 0 : &line;
}

static void keep(uint8_t byte) {
    if (byte < 0x20 || byte > 0x7E) bad = true;
    if (byte == '*') star = true;
    if (length < LONGEST_REQUEST) {
        line.text[length++] = byte;
    } else {
        too_long = true;
    }
}

line_t *line_take(uint8_t byte, bool lost) {
    if (lost) bad = true;
    if (byte == '\n') return end_line();
    if (carriage_return) bad = true; /* only the one before the line feed is dropped */
    carriage_return = byte == '\r';
    if (!carriage_return) keep(byte);
    return 0;
}
