#include "reply.h"

#include "crc.h"
#include "protocol_table.h"
#include "uart.h"

static char text[LONGEST_REPLY + 1]; /* and the line feed */
static uint8_t length, sent;
static const char *next_key;

/* The table promises that no reply is longer; a test holds it. What does not fit is left out. */
static void put(char byte) {
    if (length < LONGEST_REPLY) text[length++] = byte;
}

static void put_flash(const char *words) {
    for (char byte; (byte = pgm_read_byte(words)); words++) put(byte);
}

static void put_word(const char *words, uint8_t number) {
    char byte;
    for (; number; words++) {
        if (pgm_read_byte(words) == ' ') number--;
    }
    for (; (byte = pgm_read_byte(words)) && byte != ' '; words++) put(byte);
}

static void put_key(void) {
    char byte;
    put(' ');
    for (; (byte = pgm_read_byte(next_key)) && byte != ' '; next_key++) put(byte);
    if (byte) next_key++;
    put('=');
}

/* Divide in place by ten, byte after byte: a tenth of the time that the compiler's division takes. Returns the rest. */
static uint8_t divide_by_ten(uint8_t *bytes, uint8_t count) {
    uint16_t rest = 0;
    while (count--) {
        uint16_t part = rest << 8 | bytes[count];
        uint8_t quotient = (uint32_t)part * 6554 >> 16; /* exact below 16389; part < 2560 */
        rest = part - quotient * 10;
        bytes[count] = quotient;
    }
    return rest;
}

static bool is_zero(const uint8_t *bytes, uint8_t count) {
    while (count--) {
        if (bytes[count]) return false;
    }
    return true;
}

static void put_decimal(uint8_t *bytes, uint8_t count) {
    char digits[20];
    uint8_t place = 0;
    do {
        digits[place++] = '0' + divide_by_ten(bytes, count);
    } while (!is_zero(bytes, count));
    while (place) put(digits[--place]);
}

void reply_ok(const char *keys) {
    length = 0;
    next_key = keys;
    put('O');
    put('K');
}

void reply_number(uint32_t value) {
    put_key();
    put_decimal((uint8_t *)&value, sizeof value);
}

void reply_long_number(uint64_t value) {
    put_key();
    put_decimal((uint8_t *)&value, sizeof value);
}

void reply_text(const char *value) {
    put_key();
    while (*value) put(*value++);
}

void reply_flash_text(const char *value) {
    put_key();
    put_flash(value);
}

void reply_word(const char *words, uint8_t number) {
    put_key();
    put_word(words, number);
}

static void begin_error(uint8_t code) {
    length = 0;
    put('E');
    put(' ');
    put_decimal(&code, 1);
    put(' ');
}

void reply_error(uint8_t code, const char *reason) {
    begin_error(code);
    put_flash(reason);
}

void reply_error_word(uint8_t code, const char *words, uint8_t number) {
    begin_error(code);
    put_word(words, number);
}

bool reply_is_error(void) {
    return text[0] == 'E';
}

static void put_seal(void) {
    char seal[SEAL_LENGTH];
    crc_seal(text, length, seal);
    for (uint8_t place = 0; place < SEAL_LENGTH; place++) put(seal[place]);
}

void reply_end(bool sealed) {
    if (sealed) put_seal();
    text[length++] = '\n';
    sent = 0;
}

void reply_poll(void) {
    if (sent < length && uart_give(text[sent])) sent++;
}

bool reply_is_leaving(void) {
    return sent < length;
}
