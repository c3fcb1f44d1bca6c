/* What the parts of the core ask of each other. Ports and hosts need firmware.h alone.
 *
 * A handler returns NULL, or the text of the refusal that becomes a REJ.
 */
#ifndef FOVEA_PARTS_H
#define FOVEA_PARTS_H

#include "firmware.h"

extern const char REFUSED_DISABLED[];
extern const char REFUSED_INVALID[];
extern const char REFUSED_PARKING[];
extern const char ENDED_BY_DISABLE[];

/* answers.c: what goes to the host */
void answer(struct fovea *fovea, uint8_t method, uint8_t property, uint16_t sequence, const uint8_t *payload,
            size_t size);
void acknowledge(struct fovea *fovea, const struct packet *request, const uint8_t *payload, size_t size);
void reject(struct fovea *fovea, uint8_t property, uint16_t sequence, const char *text);
void say(struct fovea *fovea, uint8_t level, const char *text);
#define LOG_WARN 2u
#define LOG_INFO 3u

/* requests.c: one packet */
void execute(struct fovea *fovea, const struct packet *request);

/* settings.c: property GUARD */
const char *guard_get(struct fovea *fovea, const struct packet *request);
const char *guard_set(struct fovea *fovea, const struct packet *request);

/* drive.c: both DACs */
void drive_start(struct fovea *fovea);
void drive_bias(struct fovea *fovea);
void drive_recover(struct fovea *fovea);
void drive_write(struct fovea *fovea, const struct codes *codes);
void drive_filter(struct fovea *fovea, bool running);
const char *drive_move(struct fovea *fovea, const struct codes *codes); /* within limits, or not at all */
void drive_count_refusal(struct fovea *fovea, const char *refusal);

/* streams.c: the table of targets */
const char *stream_apply(struct fovea *fovea, uint8_t operation, uint8_t stream, const struct codes *codes);
const char *stream_activate(struct fovea *fovea, uint8_t stream, bool *changed);
const struct codes *stream_target(const struct fovea *fovea);

/* frames.c, lines.c: exposures, trigger and strobe lines */
const char *frame_request(struct fovea *fovea, const struct packet *request);
bool frame_pending_on(const struct fovea *fovea, uint8_t stream);
void frames_cancel(struct fovea *fovea, const char *text); /* NULL: without a word */
void frames_poll(struct fovea *fovea);
uint64_t frames_due_us(const struct fovea *fovea);
void frame_edge(struct fovea *fovea, uint8_t camera, bool high, uint64_t t_us);
void lines_raise(struct fovea *fovea, uint8_t cameras, uint32_t pulse_us);
void lines_drop(struct fovea *fovea);
void lines_poll(struct fovea *fovea);
uint64_t lines_due_us(const struct fovea *fovea);
void edges_poll(struct fovea *fovea);

/* guard.c: rail, watchdog, reboot */
void guard_boot(struct fovea *fovea);
bool guard_blocked(const struct fovea *fovea); /* switching: packets wait */
const char *guard_switch(struct fovea *fovea, const struct packet *request, bool on);
void guard_reboot(struct fovea *fovea, bool hard);
const char *guard_need_enabled(const struct fovea *fovea);
void guard_poll(struct fovea *fovea);
uint64_t guard_due_us(const struct fovea *fovea);

/* pending.c: ACTUATE and TRIGGER, which end later */
const char *actuate_request(struct fovea *fovea, const struct packet *request);
const char *trigger_request(struct fovea *fovea, const struct packet *request);
void pending_cancel(struct fovea *fovea, const char *text); /* NULL: without a word */
void pending_poll(struct fovea *fovea);
uint64_t pending_due_us(const struct fovea *fovea);

static inline uint64_t sooner(uint64_t a_us, uint64_t b_us)
{
    return a_us < b_us ? a_us : b_us;
}

static inline uint64_t host_time_us(const struct fovea *fovea, uint64_t t_us)
{
    return t_us - fovea->zero_us; /* modulo 2^64: the host may set the clock to anything */
}

void read_codes(const uint8_t *from, struct codes *codes);
void write_codes(uint8_t *to, const struct codes *codes);

#endif
