/* What goes to the host: replies, refusals, log pushes. Sequence 0 is never answered. */
#include "parts.h"

#include <string.h>

const char REFUSED_DISABLED[] = "Cannot perform action: system is not enabled";
const char REFUSED_INVALID[] = "Invalid packet";
const char REFUSED_PARKING[] = "The watchdog is parking the mirrors";
const char ENDED_BY_DISABLE[] = "System disabled";

static void transmit(struct fovea *fovea, uint8_t method, uint8_t property, uint16_t sequence,
                     const uint8_t *payload, size_t size)
{
    uint8_t wire[STUFFED_MAX];
    size_t wire_size = encode_packet(method, property, sequence, payload, size, fovea->link.crc, wire);
    if (!fovea->hal.send(fovea->hal.board, wire, wire_size)) {
        fovea->counters.unsent++;
    }
}

void answer(struct fovea *fovea, uint8_t method, uint8_t property, uint16_t sequence, const uint8_t *payload,
            size_t size)
{
    if (sequence != 0) {
        transmit(fovea, method, property, sequence, payload, size);
    }
}

void acknowledge(struct fovea *fovea, const struct packet *request, const uint8_t *payload, size_t size)
{
    answer(fovea, M_ACK, request->property, request->sequence, payload, size);
}

void reject(struct fovea *fovea, uint8_t property, uint16_t sequence, const char *text)
{
    answer(fovea, M_REJ, property, sequence, (const uint8_t *)text, strlen(text));
}

void say(struct fovea *fovea, uint8_t level, const char *text)
{
    if (fovea->log_level >= level) {
        transmit(fovea, M_SYN, P_LOG, 0, (const uint8_t *)text, strlen(text));
    }
}

void read_codes(const uint8_t *from, struct codes *codes)
{
    for (unsigned i = 0; i < CHANNEL_COUNT; i++) {
        codes->channel[i] = get_u16(from + 2 * i);
    }
}

void write_codes(uint8_t *to, const struct codes *codes)
{
    for (unsigned i = 0; i < CHANNEL_COUNT; i++) {
        put_u16(to + 2 * i, codes->channel[i]);
    }
}
