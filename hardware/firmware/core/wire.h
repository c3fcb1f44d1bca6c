/* Bytes of the protocol: stuffing, checks, numbers in little endian. Pure functions, no state. */
#ifndef FOVEA_WIRE_H
#define FOVEA_WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define PACKET_MAX 254u  /* checksum, head, sequence, payload, CRC */
#define STUFFED_MAX 256u /* a packet of 254 bytes, stuffed, with its delimiter */
#define HEADER_SIZE 4u
#define CRC_SIZE 2u
#define PAYLOAD_MAX (PACKET_MAX - HEADER_SIZE - CRC_SIZE)

enum method { M_NOP = 0x0, M_GET = 0x1, M_SET = 0x2, M_ACK = 0x3, M_REJ = 0x4, M_FIN = 0x5, M_SYN = 0xF };

enum property {
    P_NONE = 0x0,
    P_INFO = 0x1,
    P_VERSION = 0x2,
    P_RESET = 0x3,
    P_ENABLE = 0x4,
    P_LOG_LEVEL = 0x5,
    P_LPF = 0x6,
    P_BIAS = 0x7,
    P_STREAM = 0x8,
    P_FRAME = 0x9,
    P_ACTUATE = 0xA,
    P_TRIGGER = 0xB,
    P_TIMESTAMP = 0xC,
    P_GUARD = 0xD,
    P_VOLTS = 0xE,
    P_LOG = 0xF
};

struct packet {
    uint8_t method;
    uint8_t property;
    uint16_t sequence;
    uint8_t size;
    uint8_t payload[PACKET_MAX - HEADER_SIZE];
};

enum decoded { DECODED, MALFORMED, WRONG_CHECK };

/* Stuff `size` <= 254 bytes into `out` (STUFFED_MAX bytes), delimiter included; return how many. */
size_t stuff(const uint8_t *data, size_t size, uint8_t *out);

/* Unstuff in place, delimiter cut off before; return false when the run lengths do not add up. */
bool unstuff(uint8_t *data, size_t *size);

uint16_t crc16(const uint8_t *data, size_t size);

/* Put a packet on the wire: return the size of its stuffed bytes in `out` (STUFFED_MAX bytes). */
size_t encode_packet(uint8_t method, uint8_t property, uint16_t sequence, const uint8_t *payload, size_t size,
                     bool crc, uint8_t *out);

/* Read one stuffed frame, destroying it. With `crc`, `*plain` tells a four-byte packet that came without one. */
enum decoded decode_packet(uint8_t *frame, size_t size, bool crc, struct packet *packet, bool *plain);

uint16_t get_u16(const uint8_t *from);
uint32_t get_u32(const uint8_t *from);
uint64_t get_u64(const uint8_t *from);
void put_u16(uint8_t *to, uint16_t value);
void put_u32(uint8_t *to, uint32_t value);
void put_u64(uint8_t *to, uint64_t value);

#endif
