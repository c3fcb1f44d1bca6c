/* Stuffing, checks and numbers of the protocol. */
#include "wire.h"

#include <string.h>

#define FULL_RUN 0xFFu

size_t stuff(const uint8_t *data, size_t size, uint8_t *out)
{
    size_t code_at = 0;
    size_t at = 1;
    uint8_t code = 1;
    for (size_t i = 0; i < size; i++) {
        if (data[i] != 0) {
            out[at++] = data[i];
            code++;
        }
        if (data[i] == 0 || (code == FULL_RUN && i + 1 < size)) {
            out[code_at] = code;
            code_at = at++;
            code = 1;
        }
    }
    out[code_at] = code;
    out[at++] = 0;
    return at;
}

bool unstuff(uint8_t *data, size_t *size)
{
    size_t from = 0;
    size_t to = 0;
    while (from < *size) {
        uint8_t code = data[from];
        if (code == 0 || from + code > *size) {
            return false;
        }
        for (size_t i = 1; i < code; i++) {
            data[to++] = data[from + i];
        }
        from += code;
        if (code != FULL_RUN && from < *size) {
            data[to++] = 0;
        }
    }
    *size = to;
    return true;
}

static uint8_t xor8(const uint8_t *data, size_t size)
{
    uint8_t sum = 0;
    for (size_t i = 0; i < size; i++) {
        sum ^= data[i];
    }
    return sum;
}

uint16_t crc16(const uint8_t *data, size_t size)
{
    uint32_t crc = 0xFFFFu;
    for (size_t i = 0; i < size; i++) {
        crc ^= (uint32_t)data[i] << 8;
        for (int bit = 0; bit < 8; bit++) {
            crc = (crc & 0x8000u) != 0 ? (crc << 1) ^ 0x1021u : crc << 1;
        }
        crc &= 0xFFFFu;
    }
    return (uint16_t)crc;
}

size_t encode_packet(uint8_t method, uint8_t property, uint16_t sequence, const uint8_t *payload, size_t size,
                     bool crc, uint8_t *out)
{
    uint8_t packet[PACKET_MAX];
    if (size > PAYLOAD_MAX) {
        size = PAYLOAD_MAX; /* only a text could be so long; none is */
    }
    packet[1] = (uint8_t)(method << 4 | property);
    put_u16(packet + 2, sequence);
    if (size > 0) {
        memcpy(packet + HEADER_SIZE, payload, size);
    }
    size += HEADER_SIZE;
    if (crc) {
        put_u16(packet + size, crc16(packet + 1, size - 1));
        size += CRC_SIZE;
    }
    packet[0] = xor8(packet + 1, size - 1);
    return stuff(packet, size, out);
}

/* Tell a packet that a host who knows of no CRC opens a conversation with. */
static bool opens_plainly(const uint8_t *data, size_t size)
{
    return size == HEADER_SIZE &&
           (data[1] >> 4 == M_NOP || data[1] == (M_GET << 4 | P_VERSION) || data[1] == (M_GET << 4 | P_INFO));
}

static bool is_method(uint8_t method)
{
    return method <= M_FIN || method == M_SYN;
}

enum decoded decode_packet(uint8_t *frame, size_t size, bool crc, struct packet *packet, bool *plain)
{
    *plain = false;
    if (!unstuff(frame, &size) || size < HEADER_SIZE || size > PACKET_MAX) {
        return MALFORMED;
    }
    if (xor8(frame, size) != 0) {
        return WRONG_CHECK;
    }
    if (crc && opens_plainly(frame, size)) {
        *plain = true;
    } else if (crc) {
        if (size < HEADER_SIZE + CRC_SIZE || crc16(frame + 1, size - 3) != get_u16(frame + size - CRC_SIZE)) {
            return WRONG_CHECK;
        }
        size -= CRC_SIZE;
    }
    packet->method = (uint8_t)(frame[1] >> 4);
    packet->property = frame[1] & 0xFu;
    packet->sequence = get_u16(frame + 2);
    packet->size = (uint8_t)(size - HEADER_SIZE);
    memcpy(packet->payload, frame + HEADER_SIZE, packet->size);
    return is_method(packet->method) ? DECODED : MALFORMED;
}

uint16_t get_u16(const uint8_t *from)
{
    return (uint16_t)(from[0] | from[1] << 8);
}

uint32_t get_u32(const uint8_t *from)
{
    return get_u16(from) | (uint32_t)get_u16(from + 2) << 16;
}

uint64_t get_u64(const uint8_t *from)
{
    return get_u32(from) | (uint64_t)get_u32(from + 4) << 32;
}

void put_u16(uint8_t *to, uint16_t value)
{
    to[0] = (uint8_t)(value & 0xFFu);
    to[1] = (uint8_t)(value >> 8);
}

void put_u32(uint8_t *to, uint32_t value)
{
    put_u16(to, (uint16_t)(value & 0xFFFFu));
    put_u16(to + 2, (uint16_t)(value >> 16));
}

void put_u64(uint8_t *to, uint64_t value)
{
    put_u32(to, (uint32_t)(value & 0xFFFFFFFFu));
    put_u32(to + 4, (uint32_t)(value >> 32));
}
