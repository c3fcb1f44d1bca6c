/* The loop: time, bytes into packets, everything that is due. */
#include "firmware.h"

#include <string.h>

#include "parts.h"

#define FACTORY_LOW_PASS_HZ 60u

static void read_clock(struct fovea *fovea)
{
    uint32_t micros = fovea->hal.micros(fovea->hal.board);
    fovea->now_us += micros - fovea->micros; /* modulo 2^32: polled at least once in 71 minutes */
    fovea->micros = micros;
}

static uint32_t next_boot_id(uint32_t noise, uint32_t last)
{
    uint32_t id = noise != 0 ? noise : 1u;
    if (id == last) {
        id = id == UINT32_MAX ? 1u : id + 1u;
    }
    return id;
}

void fovea_boot(struct fovea *fovea, const struct fovea_hal *hal)
{
    struct fovea_hal kept = *hal;
    uint32_t boot_id = next_boot_id(kept.entropy(kept.board), fovea->boot_id);
    memset(fovea, 0, sizeof *fovea);
    fovea->hal = kept;
    fovea->boot_id = boot_id;
    fovea->micros = kept.micros(kept.board);
    fovea->log_level = LOG_INFO;
    fovea->limits = limits_default();
    fovea->drive.low_pass_hz = FACTORY_LOW_PASS_HZ;
    guard_boot(fovea);
}

size_t fovea_receive(struct fovea *fovea, const uint8_t *data, size_t size)
{
    struct link *link = &fovea->link;
    size_t taken = 0;
    while (taken < size && link->rx_count < RX_SIZE) {
        link->rx[(link->rx_first + link->rx_count) % RX_SIZE] = data[taken++];
        link->rx_count++;
    }
    return taken;
}

static void end_frame(struct fovea *fovea)
{
    struct link *link = &fovea->link;
    struct packet packet;
    bool plain;
    enum decoded decoded = decode_packet(link->frame, link->frame_size, link->crc, &packet, &plain);
    if (link->overlong) {
        fovea->counters.overlong++;
    } else if (decoded == MALFORMED) {
        fovea->counters.malformed++;
    } else if (decoded == WRONG_CHECK) {
        fovea->counters.wrong_checks++;
    } else {
        link->crc = link->crc && !plain;
        fovea->guard.fed_us = fovea->now_us;
        execute(fovea, &packet);
    }
}

/* Take bytes up to the end of one frame. */
static void take_frame(struct fovea *fovea)
{
    struct link *link = &fovea->link;
    while (link->rx_count > 0) {
        uint8_t byte = link->rx[link->rx_first];
        link->rx_first = (uint16_t)((link->rx_first + 1u) % RX_SIZE);
        link->rx_count--;
        if (byte == 0) {
            end_frame(fovea);
            link->frame_size = 0;
            link->overlong = false;
            return;
        }
        if (link->frame_size < sizeof link->frame) {
            link->frame[link->frame_size++] = byte;
        } else {
            link->overlong = true;
        }
    }
}

void fovea_poll(struct fovea *fovea)
{
    read_clock(fovea);
    edges_poll(fovea);
    lines_poll(fovea);
    frames_poll(fovea);
    pending_poll(fovea);
    guard_poll(fovea);
    if (!guard_blocked(fovea)) {
        take_frame(fovea);
    }
}

uint32_t fovea_idle_us(struct fovea *fovea)
{
    read_clock(fovea);
    bool bytes = fovea->link.rx_count > 0 && !guard_blocked(fovea);
    if (bytes || fovea->edges.tail != fovea->edges.head) {
        return 0;
    }
    uint64_t due_us = sooner(sooner(guard_due_us(fovea), frames_due_us(fovea)),
                             sooner(lines_due_us(fovea), pending_due_us(fovea)));
    if (due_us == NEVER_US) {
        return UINT32_MAX;
    }
    uint64_t wait_us = due_us > fovea->now_us ? due_us - fovea->now_us : 0u;
    return wait_us < UINT32_MAX ? (uint32_t)wait_us : UINT32_MAX - 1u;
}
