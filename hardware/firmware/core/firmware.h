/* The mirror controller's firmware: one struct that holds everything, and the five calls that a port makes.
 *
 * fovea_boot once; then fovea_receive with what came from the host and fovea_poll, for ever. Strobe edges may be
 * reported from an interrupt. Nothing allocates, nothing waits, no byte sequence makes it stop.
 */
#ifndef FOVEA_FIRMWARE_H
#define FOVEA_FIRMWARE_H

#include "hal.h"
#include "limits.h"
#include "wire.h"

#define STREAM_COUNT 64u
#define QUEUE_SIZE 8u
#define RX_SIZE 1024u
#define EDGE_COUNT 16u
#define NEVER_US UINT64_MAX

struct target { /* a stream */
    bool exists;
    struct codes codes;
};

struct streams {
    struct target table[STREAM_COUNT];
    bool has_active;
    uint8_t active;
};

struct drive {
    struct codes on_pins;
    uint16_t bias_code;
    uint16_t low_pass_hz;
    uint64_t recovery_us;
};

struct frame {
    uint16_t sequence;
    uint8_t stream;
    uint8_t cameras;
    uint32_t pulse_us;
    uint32_t settle_us;
};

enum frame_phase { FRAME_NONE, FRAME_SETTLING, FRAME_EXPOSING };

struct frames {
    struct frame queue[QUEUE_SIZE]; /* the oldest first */
    uint8_t queued;
    enum frame_phase phase;
    struct frame work;
    uint64_t ready_us;
    uint64_t trigger_us;
    uint64_t give_up_us;
    uint8_t risen;
    uint8_t fallen;
    uint64_t start_us;
    struct codes start;
    struct codes end;
    uint32_t count;
};

struct lines { /* trigger lines */
    uint8_t high;
    uint64_t fall_us[CAMERA_COUNT];
};

struct edge { /* of a strobe line */
    uint32_t t_us;
    uint8_t camera;
    bool high;
};

struct edges { /* one writer, an interrupt; one reader, the poll */
    volatile struct edge ring[EDGE_COUNT];
    volatile uint8_t head;
    volatile uint8_t tail;
    volatile uint32_t lost;
};

struct pending { /* a request with two phases */
    bool active;
    uint16_t sequence;
    uint64_t due_us;
    uint8_t payload[20];
};

enum power { POWER_OFF, POWER_RISING, POWER_ON, POWER_FALLING, POWER_PARKING, POWER_RESTING, POWER_REBOOTING };

struct guard {
    enum power power;
    bool parked_by_watchdog;
    bool hard_reboot;
    uint16_t sequence; /* of the request that switches */
    uint64_t due_us;   /* when the switching goes on */
    uint64_t fed_us;
    uint64_t log_us;
    uint32_t watchdog_ms;
    uint32_t park_ms;
    uint32_t park_slew_code_per_ms;
};

struct counters {
    uint32_t malformed;
    uint32_t wrong_checks;
    uint32_t overlong;
    uint32_t refused_moves;
    uint32_t watchdog_parks;
    uint32_t unsent;
};

struct link {
    uint8_t rx[RX_SIZE];
    uint16_t rx_first;
    uint16_t rx_count;
    uint8_t frame[STUFFED_MAX];
    uint16_t frame_size;
    bool overlong;
    bool crc;
};

struct fovea {
    struct fovea_hal hal;
    uint64_t now_us;  /* since the first boot, never wrapping */
    uint64_t zero_us; /* when the host's clock read 0; may lie in the future */
    uint32_t micros;
    uint32_t boot_id;
    uint8_t log_level;
    struct link link;
    struct counters counters;
    struct guard guard;
    struct limits limits;
    struct slew_budget slew;
    struct drive drive;
    struct streams streams;
    struct frames frames;
    struct lines lines;
    struct edges edges;
    struct pending actuate;
    struct pending trigger;
};

/* Start: rail off, trigger lines low, everything as from the factory. */
void fovea_boot(struct fovea *fovea, const struct fovea_hal *hal);

/* Take bytes from the host; return how many there was room for. Offer the rest again after a poll. */
size_t fovea_receive(struct fovea *fovea, const uint8_t *data, size_t size);

/* Do what is due, and at most one packet. */
void fovea_poll(struct fovea *fovea);

/* Return how long nothing will be due, us; UINT32_MAX when only bytes or strobes can bring anything. */
uint32_t fovea_idle_us(struct fovea *fovea);

/* Report an edge of a strobe line, at the HAL's microseconds; from one interrupt priority only, or from the loop. */
void fovea_strobe(struct fovea *fovea, uint8_t camera, bool high, uint32_t t_us);

#endif
