/* One packet from the host: what it asks, in the words of the protocol. */
#include "parts.h"

#include <string.h>

#define STREAM_SIZE 18u
#define VOLTS_SIZE 17u
#define AXES 4u

enum { RESET_SOFT = 0, RESET_HARD = 1, RESET_DACS = 2 };

static const char NAME[] = "FoveaCam mirror controller +guard";
static const uint8_t VERSION[] = {2, 1, 0};

static const char *acknowledge_u16(struct fovea *fovea, const struct packet *request, uint16_t value)
{
    uint8_t payload[2];
    put_u16(payload, value);
    acknowledge(fovea, request, payload, sizeof payload);
    return NULL;
}

static const char *acknowledge_u8(struct fovea *fovea, const struct packet *request, uint8_t value)
{
    acknowledge(fovea, request, &value, 1);
    return NULL;
}

static const char *acknowledge_time(struct fovea *fovea, const struct packet *request)
{
    uint8_t payload[8];
    put_u64(payload, host_time_us(fovea, fovea->now_us));
    acknowledge(fovea, request, payload, sizeof payload);
    return NULL;
}

static const char *get(struct fovea *fovea, const struct packet *request)
{
    if (request->size != 0) {
        return REFUSED_INVALID;
    }
    switch (request->property) {
    case P_INFO:
        acknowledge(fovea, request, (const uint8_t *)NAME, strlen(NAME));
        return NULL;
    case P_VERSION:
        acknowledge(fovea, request, VERSION, sizeof VERSION);
        return NULL;
    case P_ENABLE:
        return acknowledge_u8(fovea, request, fovea->guard.power == POWER_OFF ? 0 : 1);
    case P_LOG_LEVEL:
        return acknowledge_u8(fovea, request, fovea->log_level);
    case P_LPF:
        return acknowledge_u16(fovea, request, fovea->drive.low_pass_hz);
    case P_BIAS:
        return acknowledge_u16(fovea, request, fovea->drive.bias_code);
    case P_TIMESTAMP:
        return acknowledge_time(fovea, request);
    default:
        return REFUSED_INVALID;
    }
}

static const char *reset(struct fovea *fovea, const struct packet *request)
{
    if (request->size != 1) {
        return REFUSED_INVALID;
    }
    switch (request->payload[0]) {
    case RESET_SOFT:
    case RESET_HARD:
        acknowledge(fovea, request, NULL, 0);
        guard_reboot(fovea, request->payload[0] == RESET_HARD);
        return NULL;
    case RESET_DACS:
        if (fovea->guard.power != POWER_ON) {
            return "Cannot recover MEMS: system is not enabled";
        }
        drive_recover(fovea);
        acknowledge(fovea, request, request->payload, request->size);
        return NULL;
    default:
        return "Unknown reset type";
    }
}

static const char *set_bias(struct fovea *fovea, const struct packet *request)
{
    uint16_t code = get_u16(request->payload);
    if (fovea->guard.power != POWER_OFF) {
        return "Cannot set bias while system is enabled";
    }
    if (code > fovea->limits.channel_max_code) {
        return REFUSED_VOLTAGE;
    }
    fovea->drive.bias_code = code;
    return acknowledge_u16(fovea, request, code);
}

static const char *set_low_pass(struct fovea *fovea, const struct packet *request)
{
    fovea->drive.low_pass_hz = get_u16(request->payload);
    if (fovea->guard.power != POWER_OFF) {
        drive_filter(fovea, true);
    }
    return acknowledge_u16(fovea, request, fovea->drive.low_pass_hz);
}

static const char *set_time(struct fovea *fovea, const struct packet *request)
{
    fovea->zero_us = fovea->now_us - get_u64(request->payload);
    acknowledge(fovea, request, request->payload, request->size);
    return NULL;
}

static const char *set_stream(struct fovea *fovea, const struct packet *request)
{
    struct codes codes;
    const char *refusal = guard_need_enabled(fovea);
    if (refusal == NULL) {
        read_codes(request->payload + 2, &codes);
        refusal = stream_apply(fovea, request->payload[0], request->payload[1], &codes);
    }
    if (refusal == NULL) {
        acknowledge(fovea, request, request->payload, request->size);
    }
    return refusal;
}

/* left x, left y, right x, right y become the eight codes of the channels. */
static bool codes_of_volts(const struct fovea *fovea, const uint8_t *from, struct codes *codes)
{
    for (unsigned axis = 0; axis < AXES; axis++) {
        int32_t difference;
        if (!difference_of_volts(get_u32(from + 4 * axis), &difference) ||
            !pair_of_difference(fovea->drive.bias_code, difference, codes->channel + 2 * axis)) {
            return false;
        }
    }
    return true;
}

static const char *set_volts(struct fovea *fovea, const struct packet *request)
{
    static const uint8_t update = 1;
    uint8_t reply[VOLTS_SIZE];
    struct codes codes;
    const char *refusal = guard_need_enabled(fovea);
    if (refusal != NULL) {
        return refusal;
    }
    if (!codes_of_volts(fovea, request->payload + 1, &codes)) {
        drive_count_refusal(fovea, REFUSED_VOLTAGE);
        return REFUSED_VOLTAGE;
    }
    refusal = stream_apply(fovea, update, request->payload[0], &codes);
    if (refusal == NULL) {
        reply[0] = request->payload[0];
        write_codes(reply + 1, &codes);
        acknowledge(fovea, request, reply, sizeof reply);
    }
    return refusal;
}

static const char *set_log_level(struct fovea *fovea, const struct packet *request)
{
    fovea->log_level = request->payload[0];
    return acknowledge_u8(fovea, request, fovea->log_level);
}

static const char *set(struct fovea *fovea, const struct packet *request)
{
    uint8_t size = request->size;
    switch (request->property) {
    case P_ENABLE:
        return size == 1 ? guard_switch(fovea, request, request->payload[0] != 0) : REFUSED_INVALID;
    case P_LOG_LEVEL:
        return size == 1 ? set_log_level(fovea, request) : REFUSED_INVALID;
    case P_LPF:
        return size == 2 ? set_low_pass(fovea, request) : REFUSED_INVALID;
    case P_BIAS:
        return size == 2 ? set_bias(fovea, request) : REFUSED_INVALID;
    case P_TIMESTAMP:
        return size == 8 ? set_time(fovea, request) : REFUSED_INVALID;
    case P_STREAM:
        return size == STREAM_SIZE ? set_stream(fovea, request) : REFUSED_INVALID;
    case P_VOLTS:
        return size == VOLTS_SIZE ? set_volts(fovea, request) : REFUSED_INVALID;
    case P_RESET:
        return reset(fovea, request);
    case P_ACTUATE:
        return actuate_request(fovea, request);
    case P_TRIGGER:
        return trigger_request(fovea, request);
    case P_GUARD:
        return guard_set(fovea, request);
    default:
        return REFUSED_INVALID;
    }
}

void execute(struct fovea *fovea, const struct packet *request)
{
    const char *refusal = REFUSED_INVALID;
    if (request->method == M_NOP) {
        return;
    }
    if (request->method == M_SET) {
        refusal = set(fovea, request);
    } else if (request->method == M_GET && request->property == P_FRAME) {
        refusal = frame_request(fovea, request);
    } else if (request->method == M_GET && request->property == P_GUARD) {
        refusal = guard_get(fovea, request);
    } else if (request->method == M_GET) {
        refusal = get(fovea, request);
    }
    if (refusal != NULL) {
        reject(fovea, request->property, request->sequence, refusal);
    }
}
