/* What the core needs of a board: everything that touches a pin, a clock or a wire. A port fills one struct.
 *
 * No call may block for longer than a DAC word takes; none may call back into the core.
 */
#ifndef FOVEA_HAL_H
#define FOVEA_HAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Mirrors, as a mask: which DACs take a word. Both at once means both chip selects low for one transfer. */
#define MIRROR_LEFT 1u
#define MIRROR_RIGHT 2u
#define MIRROR_BOTH 3u

/* Cameras, as a mask: trigger lines out, strobe lines in. */
#define CAMERA_CENTRE 1u
#define CAMERA_LEFT 2u
#define CAMERA_RIGHT 4u
#define CAMERA_ALL 7u
#define CAMERA_COUNT 3u

struct fovea_hal {
    void *board; /* handed back in every call */

    /* Free-running microseconds, all 32 bits, wrapping to 0. */
    uint32_t (*micros)(void *board);

    /* Shift the 24-bit word out to the DACs in `mirrors`, most significant bit first. */
    void (*dac)(void *board, uint8_t mirrors, uint32_t word);

    /* Switch the mirrors' high-voltage rail. Must be off by itself whenever the processor is in reset. */
    void (*rail)(void *board, bool on);

    /* Run the drive filters' clock at `clock_hz` (60 times the cut-off); 0 stops it. */
    void (*filter_clock)(void *board, uint32_t clock_hz);

    /* Set all three trigger lines: the cameras in `high` high, the others low. */
    void (*triggers)(void *board, uint8_t high);

    /* Queue bytes to the host without waiting; take all or nothing, and return whether they were taken. */
    bool (*send)(void *board, const uint8_t *data, size_t size);

    /* Any 32 bits that differ from boot to boot: a noise source, or a counter in non-volatile memory. */
    uint32_t (*entropy)(void *board);

    /* Restart the processor (RESET type 1); may return where there is nothing to restart. */
    void (*reboot)(void *board);

    /* Whether the centre camera's strobe is wired. */
    bool centre_strobe;
};

#endif
