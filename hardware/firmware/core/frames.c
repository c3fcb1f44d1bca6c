/* Triggered exposures: one in work, eight in the queue, one a stream. */
#include "parts.h"

#include <string.h>

#define STROBE_GRACE_US 5000u
#define REQUEST_SIZE 10u
#define REPORT_SIZE 37u

static bool is_pending(const struct frames *frames, uint8_t stream)
{
    if (frames->phase != FRAME_NONE && frames->work.stream == stream) {
        return true;
    }
    for (unsigned i = 0; i < frames->queued; i++) {
        if (frames->queue[i].stream == stream) {
            return true;
        }
    }
    return false;
}

bool frame_pending_on(const struct fovea *fovea, uint8_t stream)
{
    return is_pending(&fovea->frames, stream);
}

/* Take the oldest frame of the queue into work; one that may not be shown is refused, and the next one taken. */
static void begin_next(struct fovea *fovea)
{
    struct frames *frames = &fovea->frames;
    while (frames->phase == FRAME_NONE && frames->queued > 0) {
        frames->work = frames->queue[0];
        frames->queued--;
        memmove(frames->queue, frames->queue + 1, frames->queued * sizeof frames->queue[0]);
        bool changed;
        const char *refusal = stream_activate(fovea, frames->work.stream, &changed);
        if (refusal != NULL) {
            reject(fovea, P_FRAME, frames->work.sequence, refusal);
            continue;
        }
        frames->ready_us = fovea->now_us + (changed ? frames->work.settle_us : 0u);
        frames->phase = FRAME_SETTLING;
    }
}

static const char *check(const struct fovea *fovea, const struct frame *frame)
{
    const struct frames *frames = &fovea->frames;
    if (frame->stream >= STREAM_COUNT || !fovea->streams.table[frame->stream].exists) {
        return "Unknown stream";
    }
    if ((frame->cameras & ~CAMERA_ALL) != 0) {
        return "Invalid camera mask";
    }
    if ((frame->cameras & CAMERA_CENTRE) != 0 && !fovea->hal.centre_strobe) {
        return "Center camera (C) has no strobe cable connected";
    }
    if (is_pending(frames, frame->stream)) {
        return "Stream already has a pending frame request";
    }
    return frames->queued >= QUEUE_SIZE ? "Frame queue is full" : NULL;
}

const char *frame_request(struct fovea *fovea, const struct packet *request)
{
    struct frames *frames = &fovea->frames;
    const char *refusal = guard_need_enabled(fovea);
    if (refusal != NULL) {
        return refusal;
    }
    if (request->size != REQUEST_SIZE) {
        return REFUSED_INVALID;
    }
    struct frame frame = {
        .sequence = request->sequence,
        .stream = request->payload[0],
        .cameras = request->payload[1] != 0 ? request->payload[1] : CAMERA_LEFT | CAMERA_RIGHT,
        .pulse_us = get_u32(request->payload + 2),
        .settle_us = get_u32(request->payload + 6),
    };
    refusal = check(fovea, &frame);
    if (refusal == NULL) {
        uint8_t position = (uint8_t)(frames->queued + (frames->phase != FRAME_NONE ? 1u : 0u));
        acknowledge(fovea, request, &position, 1);
        frames->queue[frames->queued++] = frame;
        begin_next(fovea);
    }
    return refusal;
}

void frames_cancel(struct fovea *fovea, const char *text)
{
    struct frames *frames = &fovea->frames;
    if (text != NULL && frames->phase != FRAME_NONE) {
        reject(fovea, P_FRAME, frames->work.sequence, text);
    }
    for (unsigned i = 0; text != NULL && i < frames->queued; i++) {
        reject(fovea, P_FRAME, frames->queue[i].sequence, text);
    }
    frames->phase = FRAME_NONE;
    frames->queued = 0;
}

static void expose(struct fovea *fovea)
{
    struct frames *frames = &fovea->frames;
    frames->phase = FRAME_EXPOSING;
    frames->risen = 0;
    frames->fallen = 0;
    frames->trigger_us = fovea->now_us;
    frames->give_up_us = fovea->now_us + frames->work.pulse_us + STROBE_GRACE_US;
    lines_raise(fovea, frames->work.cameras, frames->work.pulse_us);
}

static void mean_of(const struct codes *a, const struct codes *b, struct codes *mean)
{
    for (unsigned i = 0; i < CHANNEL_COUNT; i++) {
        mean->channel[i] = (uint16_t)(((uint32_t)a->channel[i] + b->channel[i] + 1u) / 2u);
    }
}

static void finish(struct fovea *fovea)
{
    struct frames *frames = &fovea->frames;
    uint8_t report[REPORT_SIZE];
    struct codes mean;
    frames->count++;
    mean_of(&frames->start, &frames->end, &mean);
    report[0] = frames->work.stream;
    put_u32(report + 1, frames->count);
    put_u64(report + 5, host_time_us(fovea, frames->trigger_us));
    put_u64(report + 13, host_time_us(fovea, frames->start_us));
    write_codes(report + 21, &mean);
    frames->phase = FRAME_NONE;
    answer(fovea, M_FIN, P_FRAME, frames->work.sequence, report, sizeof report);
    begin_next(fovea);
}

void frame_edge(struct fovea *fovea, uint8_t camera, bool high, uint64_t t_us)
{
    struct frames *frames = &fovea->frames;
    const struct codes *target = stream_target(fovea);
    if (frames->phase != FRAME_EXPOSING || (camera & frames->work.cameras) == 0 || target == NULL) {
        return;
    }
    if (high && (frames->risen & camera) == 0) {
        if (frames->risen == 0) {
            frames->start_us = t_us;
            frames->start = *target;
        }
        frames->risen |= camera;
    } else if (!high && (frames->risen & camera) != 0) {
        frames->fallen |= camera;
        frames->end = *target;
    }
    if (frames->fallen == frames->work.cameras) {
        finish(fovea);
    }
}

void frames_poll(struct fovea *fovea)
{
    struct frames *frames = &fovea->frames;
    if (frames->phase == FRAME_EXPOSING && fovea->now_us >= frames->give_up_us) {
        frames->phase = FRAME_NONE;
        reject(fovea, P_FRAME, frames->work.sequence, "Strobe timeout");
        begin_next(fovea);
    }
    /* A line still high from the pulse before shows the camera no edge: wait for its fall. */
    if (frames->phase == FRAME_SETTLING && fovea->now_us >= frames->ready_us &&
        (fovea->lines.high & frames->work.cameras) == 0) {
        expose(fovea);
    }
}

uint64_t frames_due_us(const struct fovea *fovea)
{
    const struct frames *frames = &fovea->frames;
    switch (frames->phase) {
    case FRAME_EXPOSING:
        return frames->give_up_us;
    case FRAME_SETTLING: /* behind a pulse, the fall of the lines comes first and wakes us */
        return (fovea->lines.high & frames->work.cameras) == 0 || frames->ready_us > fovea->now_us
                   ? frames->ready_us
                   : NEVER_US;
    default:
        return NEVER_US;
    }
}
