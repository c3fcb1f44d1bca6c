/* Rail and watchdog: the only place that switches the high voltage.
 *
 * off -> rising -> on -> falling -> off, by ENABLE; on -> parking -> resting -> off, by the watchdog; rebooting.
 */
#include "parts.h"

#include <string.h>

#define SWITCH_US 1000u
#define REBOOT_US 100000u
#define RECOVERY_US 1000000u
#define PARK_TICK_US 1000u
#define US_PER_MS 1000u
#define DEFAULT_WATCHDOG_MS 2000u
#define DEFAULT_PARK_MS 100u
#define DEFAULT_PARK_SLEW_CODE_PER_MS 1000u

static void rail(struct fovea *fovea, bool on)
{
    fovea->hal.rail(fovea->hal.board, on);
}

void guard_boot(struct fovea *fovea)
{
    struct guard *guard = &fovea->guard;
    guard->power = POWER_OFF;
    guard->watchdog_ms = DEFAULT_WATCHDOG_MS;
    guard->park_ms = DEFAULT_PARK_MS;
    guard->park_slew_code_per_ms = DEFAULT_PARK_SLEW_CODE_PER_MS;
    rail(fovea, false);
    drive_filter(fovea, false);
    lines_drop(fovea);
}

bool guard_blocked(const struct fovea *fovea)
{
    enum power power = fovea->guard.power;
    return power == POWER_RISING || power == POWER_FALLING || power == POWER_REBOOTING;
}

const char *guard_need_enabled(const struct fovea *fovea)
{
    return fovea->guard.power == POWER_ON ? NULL : REFUSED_DISABLED;
}

static void end_everything(struct fovea *fovea, const char *text)
{
    frames_cancel(fovea, text);
    pending_cancel(fovea, text);
    lines_drop(fovea);
    memset(&fovea->streams, 0, sizeof fovea->streams);
}

static void switching(struct fovea *fovea, enum power power, uint16_t sequence, uint32_t wait_us)
{
    fovea->guard.power = power;
    fovea->guard.sequence = sequence;
    fovea->guard.due_us = fovea->now_us + wait_us;
}

const char *guard_switch(struct fovea *fovea, const struct packet *request, bool on)
{
    enum power power = fovea->guard.power;
    uint8_t state = on ? 1 : 0;
    if (on == (power == POWER_ON) && (power == POWER_ON || power == POWER_OFF)) {
        acknowledge(fovea, request, &state, 1);
    } else if (!on) {
        end_everything(fovea, ENDED_BY_DISABLE);
        drive_bias(fovea);
        switching(fovea, POWER_FALLING, request->sequence, SWITCH_US);
    } else if (power != POWER_OFF) {
        return REFUSED_PARKING;
    } else if (fovea->drive.bias_code > fovea->limits.channel_max_code) {
        return REFUSED_VOLTAGE;
    } else {
        rail(fovea, true);
        switching(fovea, POWER_RISING, request->sequence, SWITCH_US);
    }
    return NULL;
}

void guard_reboot(struct fovea *fovea, bool hard)
{
    if (fovea->guard.power != POWER_OFF) {
        drive_bias(fovea);
    }
    end_everything(fovea, NULL);
    fovea->guard.hard_reboot = hard;
    switching(fovea, POWER_REBOOTING, 0, REBOOT_US);
}

static void arrive_on(struct fovea *fovea)
{
    static const uint8_t state = 1;
    drive_start(fovea);
    drive_filter(fovea, true);
    fovea->guard.power = POWER_ON;
    fovea->guard.parked_by_watchdog = false;
    fovea->guard.fed_us = fovea->now_us;
    fovea->drive.recovery_us = fovea->now_us + RECOVERY_US;
    say(fovea, LOG_INFO, "[INFO] MEMS Enable");
    answer(fovea, M_ACK, P_ENABLE, fovea->guard.sequence, &state, 1);
}

static void arrive_off(struct fovea *fovea)
{
    static const uint8_t state = 0;
    rail(fovea, false);
    drive_filter(fovea, false);
    fovea->guard.power = POWER_OFF;
    say(fovea, LOG_INFO, "[INFO] MEMS Disable");
    answer(fovea, M_ACK, P_ENABLE, fovea->guard.sequence, &state, 1);
}

static void start_parking(struct fovea *fovea)
{
    fovea->counters.watchdog_parks++;
    fovea->guard.parked_by_watchdog = true;
    end_everything(fovea, ENDED_BY_DISABLE);
    say(fovea, LOG_WARN, "[WARN] Watchdog: no packet, parking the mirrors");
    switching(fovea, POWER_PARKING, 0, 0);
}

/* Every channel goes towards the bias by as much: no pair ever gets further apart than it was. */
static void park_step(struct fovea *fovea)
{
    struct codes next = fovea->drive.on_pins;
    uint16_t bias = fovea->drive.bias_code;
    uint16_t step = (uint16_t)fovea->guard.park_slew_code_per_ms;
    bool moved = false;
    for (unsigned i = 0; i < CHANNEL_COUNT; i++) {
        uint16_t code = next.channel[i];
        uint16_t missing = code > bias ? (uint16_t)(code - bias) : (uint16_t)(bias - code);
        uint16_t by = missing < step ? missing : step;
        next.channel[i] = code > bias ? (uint16_t)(code - by) : (uint16_t)(code + by);
        moved = moved || by > 0;
    }
    if (moved) {
        drive_write(fovea, &next);
        switching(fovea, POWER_PARKING, 0, PARK_TICK_US);
    } else {
        drive_bias(fovea);
        switching(fovea, POWER_RESTING, 0, fovea->guard.park_ms * US_PER_MS);
    }
}

static void restart(struct fovea *fovea)
{
    struct fovea_hal hal = fovea->hal;
    if (fovea->guard.hard_reboot) {
        rail(fovea, false);
        hal.reboot(hal.board);
    }
    fovea_boot(fovea, &hal);
}

static uint64_t starved_us(const struct fovea *fovea)
{
    return fovea->guard.fed_us + (uint64_t)fovea->guard.watchdog_ms * US_PER_MS;
}

static void watch(struct fovea *fovea)
{
    if (fovea->now_us >= starved_us(fovea)) {
        start_parking(fovea);
    } else if (fovea->now_us >= fovea->drive.recovery_us) {
        fovea->drive.recovery_us = fovea->now_us + RECOVERY_US;
        drive_recover(fovea);
    }
}

void guard_poll(struct fovea *fovea)
{
    if (fovea->guard.power == POWER_ON) {
        watch(fovea);
    }
    if (fovea->guard.power == POWER_ON || fovea->now_us < fovea->guard.due_us) {
        return;
    }
    switch (fovea->guard.power) {
    case POWER_RISING:
        arrive_on(fovea);
        break;
    case POWER_PARKING:
        park_step(fovea);
        break;
    case POWER_FALLING:
    case POWER_RESTING:
        arrive_off(fovea);
        break;
    case POWER_REBOOTING:
        restart(fovea);
        break;
    default:
        break;
    }
}

uint64_t guard_due_us(const struct fovea *fovea)
{
    switch (fovea->guard.power) {
    case POWER_OFF:
        return NEVER_US;
    case POWER_ON:
        return sooner(starved_us(fovea), fovea->drive.recovery_us);
    default:
        return fovea->guard.due_us;
    }
}
