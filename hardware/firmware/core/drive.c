/* Both quad DACs (AD5664R) by their 24-bit words: command << 3 | channel, then the value.
 *
 * A move fills all eight input registers (command 0, outputs stand still) and loads them with one word that both
 * chips take at once: no moment sees half a pair, or one mirror without the other.
 */
#include "parts.h"

#define WORD_RESET 0x280001u
#define WORD_REFERENCE 0x380001u
#define WORD_POWER 0x20000Fu
#define WORD_SOFTWARE_LOAD 0x300000u
#define WORD_LOAD_ALL 0x0F0000u
#define WORD_WRITE_LOAD_ALL 0x1F0000u
#define CLOCK_PER_CUTOFF 60u
#define CHANNELS_A_MIRROR 4u
#define LOG_EVERY_US 1000000u

static const uint8_t LETTER[CHANNELS_A_MIRROR] = {0, 1, 3, 2}; /* ch2 is wired to D, ch3 to C */

static void word(struct fovea *fovea, uint8_t mirrors, uint32_t value)
{
    fovea->hal.dac(fovea->hal.board, mirrors, value);
}

static void all_on_bias(struct fovea *fovea)
{
    word(fovea, MIRROR_BOTH, WORD_WRITE_LOAD_ALL | fovea->drive.bias_code);
    for (unsigned i = 0; i < CHANNEL_COUNT; i++) {
        fovea->drive.on_pins.channel[i] = fovea->drive.bias_code;
    }
}

void drive_start(struct fovea *fovea)
{
    word(fovea, MIRROR_BOTH, WORD_RESET);
    word(fovea, MIRROR_BOTH, WORD_REFERENCE);
    word(fovea, MIRROR_BOTH, WORD_POWER);
    word(fovea, MIRROR_BOTH, WORD_SOFTWARE_LOAD);
    all_on_bias(fovea);
    limits_refill(&fovea->limits, &fovea->slew, fovea->now_us);
}

void drive_bias(struct fovea *fovea)
{
    all_on_bias(fovea);
}

void drive_write(struct fovea *fovea, const struct codes *codes)
{
    for (unsigned i = 0; i < CHANNEL_COUNT; i++) {
        uint8_t mirror = i < CHANNELS_A_MIRROR ? MIRROR_LEFT : MIRROR_RIGHT;
        word(fovea, mirror, (uint32_t)LETTER[i % CHANNELS_A_MIRROR] << 16 | codes->channel[i]);
    }
    word(fovea, MIRROR_BOTH, WORD_LOAD_ALL);
    fovea->drive.on_pins = *codes;
}

const char *drive_move(struct fovea *fovea, const struct codes *codes)
{
    const char *refusal = limits_check_voltage(&fovea->limits, codes);
    if (refusal == NULL) {
        refusal = limits_spend_slew(&fovea->limits, &fovea->slew, &fovea->drive.on_pins, codes, fovea->now_us);
    }
    if (refusal == NULL) {
        drive_write(fovea, codes);
    } else {
        drive_count_refusal(fovea, refusal);
    }
    return refusal;
}

void drive_count_refusal(struct fovea *fovea, const char *refusal)
{
    fovea->counters.refused_moves++;
    if (fovea->now_us >= fovea->guard.log_us) {
        fovea->guard.log_us = fovea->now_us + LOG_EVERY_US;
        say(fovea, LOG_WARN,
            refusal == REFUSED_SLEW ? "[WARN] A move outside the slew limits was refused"
                                    : "[WARN] A move outside the voltage limits was refused");
    }
}

void drive_recover(struct fovea *fovea)
{
    word(fovea, MIRROR_BOTH, WORD_POWER);
    word(fovea, MIRROR_BOTH, WORD_REFERENCE);
    word(fovea, MIRROR_BOTH, WORD_SOFTWARE_LOAD);
    const struct codes *target = stream_target(fovea);
    if (target == NULL || drive_move(fovea, target) != NULL) {
        struct codes again = fovea->drive.on_pins;
        drive_write(fovea, &again);
    }
}

void drive_filter(struct fovea *fovea, bool running)
{
    fovea->hal.filter_clock(fovea->hal.board, running ? CLOCK_PER_CUTOFF * fovea->drive.low_pass_hz : 0u);
}
