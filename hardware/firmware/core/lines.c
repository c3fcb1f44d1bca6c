/* Trigger lines out, strobe lines in. A line that was raised falls by its own clock, whatever becomes of the request. */
#include "parts.h"

void lines_raise(struct fovea *fovea, uint8_t cameras, uint32_t pulse_us)
{
    struct lines *lines = &fovea->lines;
    for (unsigned i = 0; i < CAMERA_COUNT; i++) {
        uint8_t camera = (uint8_t)(1u << i);
        uint64_t fall_us = fovea->now_us + pulse_us;
        if ((cameras & camera) != 0 && ((lines->high & camera) == 0 || fall_us > lines->fall_us[i])) {
            lines->fall_us[i] = fall_us;
        }
    }
    lines->high |= cameras;
    fovea->hal.triggers(fovea->hal.board, lines->high);
}

void lines_drop(struct fovea *fovea)
{
    fovea->lines.high = 0;
    fovea->hal.triggers(fovea->hal.board, 0);
}

void lines_poll(struct fovea *fovea)
{
    struct lines *lines = &fovea->lines;
    uint8_t high = lines->high;
    for (unsigned i = 0; i < CAMERA_COUNT; i++) {
        if (fovea->now_us >= lines->fall_us[i]) {
            high &= (uint8_t)~(1u << i);
        }
    }
    if (high != lines->high) {
        lines->high = high;
        fovea->hal.triggers(fovea->hal.board, high);
    }
}

uint64_t lines_due_us(const struct fovea *fovea)
{
    uint64_t due_us = NEVER_US;
    for (unsigned i = 0; i < CAMERA_COUNT; i++) {
        if ((fovea->lines.high & 1u << i) != 0) {
            due_us = sooner(due_us, fovea->lines.fall_us[i]);
        }
    }
    return due_us;
}

void fovea_strobe(struct fovea *fovea, uint8_t camera, bool high, uint32_t t_us)
{
    struct edges *edges = &fovea->edges;
    uint8_t head = edges->head;
    uint8_t next = (uint8_t)((head + 1u) % EDGE_COUNT);
    if (next == edges->tail) {
        edges->lost = edges->lost + 1u;
        return;
    }
    edges->ring[head].camera = camera;
    edges->ring[head].high = high;
    edges->ring[head].t_us = t_us;
    edges->head = next;
}

/* An edge may be a little younger than the poll's own clock reading. */
static uint64_t time_of_edge_us(const struct fovea *fovea, uint32_t t_us)
{
    uint32_t later_us = t_us - fovea->micros;
    return later_us <= UINT32_MAX / 2u ? fovea->now_us + later_us : fovea->now_us - (fovea->micros - t_us);
}

void edges_poll(struct fovea *fovea)
{
    struct edges *edges = &fovea->edges;
    while (edges->tail != edges->head) {
        uint8_t tail = edges->tail;
        uint8_t camera = edges->ring[tail].camera;
        bool high = edges->ring[tail].high;
        uint32_t t_us = edges->ring[tail].t_us;
        edges->tail = (uint8_t)((tail + 1u) % EDGE_COUNT);
        frame_edge(fovea, camera, high, time_of_edge_us(fovea, t_us));
    }
}
