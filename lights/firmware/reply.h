/* The answer to one line. Its bytes leave one by one, while the main loop goes on. */
#ifndef REPLY_H
#define REPLY_H

#include <avr/pgmspace.h>
#include <stdbool.h>
#include <stdint.h>

/* Begin `OK`; the values that follow get these keys, in their order. */
void reply_ok(const char *keys_in_flash);
void reply_number(uint32_t value);
void reply_long_number(uint64_t value);
void reply_text(const char *text);
void reply_flash_text(const char *text_in_flash);
/* The word of that number in a list of words. */
void reply_word(const char *words_in_flash, uint8_t number);

/* `E code` and what was wrong, instead of anything begun before. */
void reply_error(uint8_t code, const char *text_in_flash);
void reply_error_word(uint8_t code, const char *words_in_flash, uint8_t number);

bool reply_is_error(void);

/* End the reply, with a checksum where `sealed`. */
void reply_end(bool sealed);

/* Send what the port takes now. */
void reply_poll(void);

/* True until the last byte has been given to the port. */
bool reply_is_leaving(void);

#endif
