#include "crc.h"

void crc_seal(const char *text, uint8_t length, char seal[SEAL_LENGTH]) {
    uint16_t crc = CHECKSUM_START;
    for (uint8_t place = 0; place < length; place++) crc = crc_add(crc, text[place]);
    seal[0] = '*';
    for (uint8_t digit = 1; digit < SEAL_LENGTH; digit++, crc <<= 4) {
        uint8_t value = crc >> 12;
        seal[digit] = value < 10 ? '0' + value : 'A' - 10 + value;
    }
}
