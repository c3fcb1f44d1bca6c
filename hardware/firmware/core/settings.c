/* Property GUARD: identity, watchdog, limits, check of packets, counters. */
#include "parts.h"

#define GET_SIZE 1u
#define SET_SIZE 5u

enum item {
    ITEM_BOOT_ID,
    ITEM_STATE,
    ITEM_WATCHDOG_MS,
    ITEM_PARK_MS,
    ITEM_PARK_SLEW,
    ITEM_CHANNEL_MAX,
    ITEM_DIFFERENCE_MAX,
    ITEM_STEP_MAX,
    ITEM_SLEW,
    ITEM_CHECK,
    ITEM_MALFORMED = 16,
    ITEM_WRONG_CHECKS,
    ITEM_OVERLONG,
    ITEM_REFUSED_MOVES,
    ITEM_WATCHDOG_PARKS,
    ITEM_UNSENT,
    ITEM_LOST_EDGES
};

enum { STATE_OFF, STATE_ON, STATE_PARKING, STATE_PARKED };

struct setting {
    uint32_t *value;
    uint32_t least;
    uint32_t most;
    bool limit; /* set only while disabled */
};

static bool find_setting(struct fovea *fovea, uint8_t item, struct setting *found)
{
    struct guard *guard = &fovea->guard;
    struct limits *limits = &fovea->limits;
    const struct setting settings[] = {
        [ITEM_WATCHDOG_MS] = {&guard->watchdog_ms, 100u, 60000u, false},
        [ITEM_PARK_MS] = {&guard->park_ms, 0u, 5000u, false},
        [ITEM_PARK_SLEW] = {&guard->park_slew_code_per_ms, 1u, DAC_FULL_SCALE, false},
        [ITEM_CHANNEL_MAX] = {&limits->channel_max_code, 0u, CEILING_CHANNEL_CODE, true},
        [ITEM_DIFFERENCE_MAX] = {&limits->difference_max_code, 0u, CEILING_DIFFERENCE_CODE, true},
        [ITEM_STEP_MAX] = {&limits->step_max_code, 1u, DAC_FULL_SCALE, true},
        [ITEM_SLEW] = {&limits->slew_code_per_ms, 0u, DAC_FULL_SCALE, true},
    };
    if (item >= sizeof settings / sizeof settings[0] || settings[item].value == NULL) {
        return false;
    }
    *found = settings[item];
    return true;
}

static uint32_t state_of(const struct guard *guard)
{
    switch (guard->power) {
    case POWER_ON:
    case POWER_FALLING:
        return STATE_ON;
    case POWER_PARKING:
    case POWER_RESTING:
        return STATE_PARKING;
    default:
        return guard->parked_by_watchdog ? STATE_PARKED : STATE_OFF;
    }
}

static bool read_only(const struct fovea *fovea, uint8_t item, uint32_t *value)
{
    const struct counters *counters = &fovea->counters;
    switch (item) {
    case ITEM_BOOT_ID:
        *value = fovea->boot_id;
        return true;
    case ITEM_STATE:
        *value = state_of(&fovea->guard);
        return true;
    case ITEM_MALFORMED:
        *value = counters->malformed;
        return true;
    case ITEM_WRONG_CHECKS:
        *value = counters->wrong_checks;
        return true;
    case ITEM_OVERLONG:
        *value = counters->overlong;
        return true;
    case ITEM_REFUSED_MOVES:
        *value = counters->refused_moves;
        return true;
    case ITEM_WATCHDOG_PARKS:
        *value = counters->watchdog_parks;
        return true;
    case ITEM_UNSENT:
        *value = counters->unsent;
        return true;
    case ITEM_LOST_EDGES:
        *value = fovea->edges.lost;
        return true;
    default:
        return false;
    }
}

const char *guard_get(struct fovea *fovea, const struct packet *request)
{
    uint8_t reply[SET_SIZE];
    uint32_t value;
    struct setting setting;
    if (request->size != GET_SIZE) {
        return REFUSED_INVALID;
    }
    uint8_t item = request->payload[0];
    if (item == ITEM_CHECK) {
        value = fovea->link.crc ? 1u : 0u;
    } else if (find_setting(fovea, item, &setting)) {
        value = *setting.value;
    } else if (!read_only(fovea, item, &value)) {
        return "Unknown setting";
    }
    reply[0] = item;
    put_u32(reply + 1, value);
    acknowledge(fovea, request, reply, sizeof reply);
    return NULL;
}

static const char *set_check(struct fovea *fovea, const struct packet *request, uint32_t value)
{
    if (value > 1u) {
        return "Setting out of range";
    }
    acknowledge(fovea, request, request->payload, request->size); /* in the way agreed on until now */
    fovea->link.crc = value == 1u;
    return NULL;
}

const char *guard_set(struct fovea *fovea, const struct packet *request)
{
    struct setting setting;
    uint32_t value;
    if (request->size != SET_SIZE) {
        return REFUSED_INVALID;
    }
    uint8_t item = request->payload[0];
    if (read_only(fovea, item, &value)) {
        return "Setting is read only";
    }
    value = get_u32(request->payload + 1);
    if (item == ITEM_CHECK) {
        return set_check(fovea, request, value);
    }
    if (!find_setting(fovea, item, &setting)) {
        return "Unknown setting";
    }
    if (value < setting.least || value > setting.most) {
        return "Setting out of range";
    }
    if (setting.limit && fovea->guard.power != POWER_OFF) {
        return "Cannot change limits while system is enabled";
    }
    *setting.value = value;
    acknowledge(fovea, request, request->payload, request->size);
    return NULL;
}
