/* ACTUATE and TRIGGER: acknowledged at once, finished later. */
#include "parts.h"

#include <string.h>

#define ACTUATE_SIZE 20u
#define TRIGGER_SIZE 4u
#define CODES_SIZE 16u

static void begin(struct fovea *fovea, struct pending *pending, const struct packet *request, uint32_t wait_us)
{
    pending->active = true;
    pending->sequence = request->sequence;
    pending->due_us = fovea->now_us + wait_us;
    memcpy(pending->payload, request->payload, request->size);
    acknowledge(fovea, request, request->payload, request->size);
}

const char *actuate_request(struct fovea *fovea, const struct packet *request)
{
    if (request->size != ACTUATE_SIZE) {
        return REFUSED_INVALID;
    }
    const char *refusal = guard_need_enabled(fovea);
    if (refusal == NULL && fovea->actuate.active) {
        refusal = "An actuate request is already pending";
    }
    if (refusal == NULL) {
        struct codes codes;
        read_codes(request->payload, &codes);
        refusal = drive_move(fovea, &codes);
    }
    if (refusal == NULL) {
        begin(fovea, &fovea->actuate, request, get_u32(request->payload + CODES_SIZE));
    }
    return refusal;
}

const char *trigger_request(struct fovea *fovea, const struct packet *request)
{
    if (request->size != TRIGGER_SIZE) {
        return REFUSED_INVALID;
    }
    if (fovea->trigger.active) {
        return "A trigger request is already pending";
    }
    uint32_t pulse_us = get_u32(request->payload);
    begin(fovea, &fovea->trigger, request, pulse_us);
    lines_raise(fovea, CAMERA_ALL, pulse_us);
    return NULL;
}

static void finish(struct fovea *fovea, struct pending *pending, uint8_t property, size_t size)
{
    if (pending->active && fovea->now_us >= pending->due_us) {
        pending->active = false;
        put_u32(pending->payload + size - sizeof(uint32_t),
                (uint32_t)(host_time_us(fovea, fovea->now_us) & UINT32_MAX));
        answer(fovea, M_FIN, property, pending->sequence, pending->payload, size);
    }
}

void pending_poll(struct fovea *fovea)
{
    finish(fovea, &fovea->actuate, P_ACTUATE, ACTUATE_SIZE);
    finish(fovea, &fovea->trigger, P_TRIGGER, TRIGGER_SIZE);
}

static void cancel(struct fovea *fovea, struct pending *pending, uint8_t property, const char *text)
{
    if (pending->active && text != NULL) {
        reject(fovea, property, pending->sequence, text);
    }
    pending->active = false;
}

void pending_cancel(struct fovea *fovea, const char *text)
{
    cancel(fovea, &fovea->actuate, P_ACTUATE, text);
    cancel(fovea, &fovea->trigger, P_TRIGGER, text);
}

uint64_t pending_due_us(const struct fovea *fovea)
{
    uint64_t actuate_us = fovea->actuate.active ? fovea->actuate.due_us : NEVER_US;
    uint64_t trigger_us = fovea->trigger.active ? fovea->trigger.due_us : NEVER_US;
    return sooner(actuate_us, trigger_us);
}
