/* Voltage and slew limits, and the rounding of a pair. */
#include "limits.h"

#include <string.h>

const char REFUSED_VOLTAGE[] = "Outside the voltage limits";
const char REFUSED_SLEW[] = "Outside the slew limits";

#define MILLI 1000u
#define F32_EXPONENT 0x7F800000u

_Static_assert(sizeof(float) == sizeof(uint32_t), "VOLTS carries 32-bit floats");

struct limits limits_default(void)
{
    struct limits limits = {
        .channel_max_code = CEILING_CHANNEL_CODE,
        .difference_max_code = CEILING_DIFFERENCE_CODE,
        .step_max_code = DAC_FULL_SCALE,
        .slew_code_per_ms = 0,
    };
    return limits;
}

static uint32_t distance(uint16_t a, uint16_t b)
{
    return a > b ? (uint32_t)a - b : (uint32_t)b - a;
}

const char *limits_check_voltage(const struct limits *limits, const struct codes *codes)
{
    for (unsigned i = 0; i < CHANNEL_COUNT; i += 2) {
        uint16_t plus = codes->channel[i];
        uint16_t minus = codes->channel[i + 1];
        if (plus > limits->channel_max_code || minus > limits->channel_max_code ||
            distance(plus, minus) > limits->difference_max_code) {
            return REFUSED_VOLTAGE;
        }
    }
    return NULL;
}

static uint32_t full_millicode(const struct limits *limits)
{
    return limits->step_max_code * MILLI;
}

static void refill_for(const struct limits *limits, struct slew_budget *budget, uint64_t now_us)
{
    uint64_t gained = (now_us - budget->since_us) * limits->slew_code_per_ms; /* codes/ms * us = millicodes */
    budget->since_us = now_us;
    for (unsigned i = 0; i < CHANNEL_COUNT; i++) {
        uint32_t missing = full_millicode(limits) - budget->left_millicode[i];
        budget->left_millicode[i] += gained < missing ? (uint32_t)gained : missing;
    }
}

void limits_refill(const struct limits *limits, struct slew_budget *budget, uint64_t now_us)
{
    budget->since_us = now_us;
    for (unsigned i = 0; i < CHANNEL_COUNT; i++) {
        budget->left_millicode[i] = full_millicode(limits);
    }
}

const char *limits_spend_slew(const struct limits *limits, struct slew_budget *budget, const struct codes *from,
                              const struct codes *to, uint64_t now_us)
{
    if (limits->slew_code_per_ms == 0) {
        limits_refill(limits, budget, now_us);
    } else {
        refill_for(limits, budget, now_us);
    }
    for (unsigned i = 0; i < CHANNEL_COUNT; i++) {
        if (distance(from->channel[i], to->channel[i]) * MILLI > budget->left_millicode[i]) {
            return REFUSED_SLEW;
        }
    }
    for (unsigned i = 0; i < CHANNEL_COUNT; i++) {
        budget->left_millicode[i] -= distance(from->channel[i], to->channel[i]) * MILLI;
    }
    return NULL;
}

bool pair_of_difference(uint16_t bias_code, int32_t difference_code, uint16_t pair[2])
{
    int32_t up = difference_code >= 0 ? (difference_code + 1) / 2 : -(-difference_code / 2);
    int32_t plus = (int32_t)bias_code + up;
    int32_t minus = plus - difference_code;
    if (plus < 0 || plus > (int32_t)DAC_FULL_SCALE || minus < 0 || minus > (int32_t)DAC_FULL_SCALE) {
        return false;
    }
    pair[0] = (uint16_t)plus;
    pair[1] = (uint16_t)minus;
    return true;
}

static int32_t round_half_even(double value)
{
    int32_t whole = (int32_t)value; /* towards zero; |value| <= 65535 */
    double rest = value - (double)whole;
    int32_t outward = value < 0 ? -1 : 1;
    double size = rest < 0 ? -rest : rest;
    bool away = size > 0.5 || (size == 0.5 && whole % 2 != 0);
    return away ? whole + outward : whole;
}

bool difference_of_volts(uint32_t volts_bits, int32_t *difference_code)
{
    if ((volts_bits & F32_EXPONENT) == F32_EXPONENT) {
        return false; /* NaN or infinity */
    }
    float volts;
    memcpy(&volts, &volts_bits, sizeof volts);
    double volts_v = (double)volts;
    if (volts_v < -(double)DAC_FULL_SCALE_V || volts_v > (double)DAC_FULL_SCALE_V) {
        return false;
    }
    *difference_code = round_half_even(volts_v * (double)DAC_FULL_SCALE / (double)DAC_FULL_SCALE_V);
    return true;
}
