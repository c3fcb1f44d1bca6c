/* The table of targets: 64 streams, the active one stands on the mirrors. */
#include "parts.h"

#include <string.h>

enum { CREATE = 0, UPDATE = 1, TERMINATE = 2 };

const struct codes *stream_target(const struct fovea *fovea)
{
    const struct streams *streams = &fovea->streams;
    return streams->has_active ? &streams->table[streams->active].codes : NULL;
}

static bool exists(const struct streams *streams, uint8_t stream)
{
    return stream < STREAM_COUNT && streams->table[stream].exists;
}

static bool same(const struct codes *a, const struct codes *b)
{
    return memcmp(a, b, sizeof *a) == 0;
}

/* Bring codes onto the mirrors when they are not there. */
static const char *show(struct fovea *fovea, const struct codes *codes)
{
    return same(codes, &fovea->drive.on_pins) ? NULL : drive_move(fovea, codes);
}

/* Accept codes, and bring them onto the mirrors when `shown`. */
static const char *place(struct fovea *fovea, const struct codes *codes, bool shown)
{
    const char *refusal = limits_check_voltage(&fovea->limits, codes);
    if (refusal != NULL) {
        drive_count_refusal(fovea, refusal);
        return refusal;
    }
    return shown ? show(fovea, codes) : NULL;
}

static const char *create(struct fovea *fovea, uint8_t stream, const struct codes *codes)
{
    struct streams *streams = &fovea->streams;
    if (stream >= STREAM_COUNT || exists(streams, stream)) {
        return "Stream id out of range, or already exists";
    }
    const char *refusal = place(fovea, codes, !streams->has_active);
    if (refusal == NULL) {
        streams->table[stream].exists = true;
        streams->table[stream].codes = *codes;
        streams->active = streams->has_active ? streams->active : stream;
        streams->has_active = true;
    }
    return refusal;
}

static const char *update(struct fovea *fovea, uint8_t stream, const struct codes *codes)
{
    struct streams *streams = &fovea->streams;
    if (!exists(streams, stream)) {
        return "Unknown stream id";
    }
    bool active = streams->has_active && streams->active == stream;
    const char *refusal = place(fovea, codes, active && !same(codes, &streams->table[stream].codes));
    if (refusal == NULL) {
        streams->table[stream].codes = *codes;
    }
    return refusal;
}

static const char *terminate(struct fovea *fovea, uint8_t stream)
{
    struct streams *streams = &fovea->streams;
    if (!exists(streams, stream) || frame_pending_on(fovea, stream)) {
        return "Unknown stream id, or a frame request is pending on it";
    }
    streams->table[stream].exists = false;
    if (streams->has_active && streams->active == stream) {
        streams->has_active = false;
    }
    return NULL;
}

const char *stream_apply(struct fovea *fovea, uint8_t operation, uint8_t stream, const struct codes *codes)
{
    switch (operation) {
    case CREATE:
        return create(fovea, stream, codes);
    case UPDATE:
        return update(fovea, stream, codes);
    case TERMINATE:
        return terminate(fovea, stream);
    default:
        return "Unknown stream operation";
    }
}

const char *stream_activate(struct fovea *fovea, uint8_t stream, bool *changed)
{
    struct streams *streams = &fovea->streams;
    *changed = !streams->has_active || streams->active != stream;
    const char *refusal = show(fovea, &streams->table[stream].codes);
    if (refusal == NULL) {
        streams->active = stream;
        streams->has_active = true;
    }
    return refusal;
}
