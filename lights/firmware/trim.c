#include "trim.h"

void trim_start(trim_t *trim, uint32_t parts) {
    *trim = (trim_t){.parts = parts};
}

static const share_t *share_of(const trim_t *trim) {
    return (int32_t)(trim->step - trim->from) >= 0 ? &trim->next : &trim->now;
}

void trim_set(trim_t *trim, share_t share, uint32_t from) {
    trim->now = *share_of(trim);
    trim->next = share;
    trim->from = from;
}

int32_t trim_extra(const trim_t *trim) {
    const share_t *share = share_of(trim);
    return share->whole + (trim->parts - trim->carried <= share->rest);
}

void trim_pass(trim_t *trim) {
    trim->now = *share_of(trim);
    uint32_t room = trim->parts - trim->carried;
    trim->carried = room <= trim->now.rest ? trim->now.rest - room : trim->carried + trim->now.rest;
    trim->step++;
}
