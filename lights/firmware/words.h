/* The words of a request, one after the other. */
#ifndef WORDS_H
#define WORDS_H

#include <stdbool.h>
#include <stdint.h>

/* Cut a text at its spaces. Returns how many words stand behind the first, -1 where one of those is empty. */
int8_t words_cut(char *text);

/* The word behind the one before; the first call after words_cut gives the second word. */
char *words_next(void);

/* Decimal digits, at most 4294967295. */
bool words_number(const char *word, uint32_t *value);

/* Two such numbers with a colon between them. */
bool words_pair(const char *word, uint32_t *first, uint32_t *second);

/* The number of a word in a list of words, -1 where it is none of them. */
int8_t words_find(const char *word, const char *words_in_flash);

#endif
