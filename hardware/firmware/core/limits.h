/* Limits of the mirrors, kept here whatever a host asks: refused whole, never clipped.
 *
 * The ceilings are those of the paper's rig: bias 90 V, 170 V differential. They follow the sheet that comes with
 * a mirror, by serial number: correct them before another mirror is connected. A host can only narrow them.
 */
#ifndef FOVEA_LIMITS_H
#define FOVEA_LIMITS_H

#include <stdbool.h>
#include <stdint.h>

#define DAC_FULL_SCALE 65535u
#define DAC_FULL_SCALE_V 200u

#define CEILING_CHANNEL_CODE 57343u    /* 175 V: bias 90 V and half of 170 V */
#define CEILING_DIFFERENCE_CODE 55705u /* 170 V */

#define CHANNEL_COUNT 8u

/* DAC codes of both mirrors: left x+, x-, y+, y-, then right. */
struct codes {
    uint16_t channel[CHANNEL_COUNT];
};

struct limits {
    uint32_t channel_max_code;
    uint32_t difference_max_code;
    uint32_t step_max_code;
    uint32_t slew_code_per_ms; /* 0 = no limit but that of a step */
};

/* What each channel may still move: steps use it up, time refills it. */
struct slew_budget {
    uint32_t left_millicode[CHANNEL_COUNT];
    uint64_t since_us;
};

struct limits limits_default(void);

/* Return NULL, or why these codes may not stand on the mirrors. */
const char *limits_check_voltage(const struct limits *limits, const struct codes *codes);

/* Return NULL and use up the budget, or why this step may not be made now. */
const char *limits_spend_slew(const struct limits *limits, struct slew_budget *budget, const struct codes *from,
                              const struct codes *to, uint64_t now_us);

void limits_refill(const struct limits *limits, struct slew_budget *budget, uint64_t now_us);

/* Put a differential drive, in codes, on a pair about the bias; false when it leaves the DAC's range.
 * The difference is kept exactly; an odd one gives its odd half to the plus side. */
bool pair_of_difference(uint16_t bias_code, int32_t difference_code, uint16_t pair[2]);

/* Round f32 volts (as its 32 bits) to a difference in codes, half to even; false for NaN, infinity, beyond 200 V. */
bool difference_of_volts(uint32_t volts_bits, int32_t *difference_code);

extern const char REFUSED_VOLTAGE[];
extern const char REFUSED_SLEW[];

#endif
