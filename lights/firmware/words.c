#include "words.h"

#include <avr/pgmspace.h>
#include <string.h>

static char *word;

int8_t words_cut(char *text) {
    int8_t count = 0;
    bool empty = false;
    word = text;
    for (; *text; text++) {
        if (*text != ' ') continue;
        *text = 0;
        count++;
        if (text[1] == ' ' || !text[1]) empty = true;
    }
    return empty ? -1 : count;
}

char *words_next(void) {
    word += strlen(word) + 1;
    return word;
}

/* Read digits up to `end`. Returns what stands behind it, 0 where there is no such number. */
static const char *read_digits(const char *digits, char end, uint32_t *value) {
    *value = 0;
    if (*digits == end) return 0;
    for (; *digits != end; digits++) {
        uint8_t digit = *digits - '0';
        if (digit > 9 || *value > UINT32_MAX / 10) return 0;
        *value *= 10;
        if (digit > UINT32_MAX - *value) return 0;
        *value += digit;
    }
    return digits + 1;
}

bool words_number(const char *digits, uint32_t *value) {
    return read_digits(digits, 0, value);
}

bool words_pair(const char *pair, uint32_t *first, uint32_t *second) {
    pair = read_digits(pair, ':', first);
    return pair && read_digits(pair, 0, second);
}

int8_t words_find(const char *sought, const char *words) {
    for (int8_t number = 0;; number++) {
        uint8_t length = 0;
        while (pgm_read_byte(words + length) && pgm_read_byte(words + length) != ' ') length++;
        if (strlen(sought) == length && strncmp_P(sought, words, length) == 0) return number;
        words += length;
        if (!pgm_read_byte(words++)) return -1;
    }
}
