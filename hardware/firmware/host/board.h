/* A board without metal: the core's pins remembered as events, cameras that strobe as they are told.
 *
 * Its clock is set by whoever holds it (tests) or follows the machine's (program.c). No allocation: the holder gives
 * board_size() zeroed bytes.
 */
#ifndef FOVEA_BOARD_H
#define FOVEA_BOARD_H

#include "firmware.h"

#define BOARD_OUT_SIZE 65536u
#define BOARD_IN_SIZE 65536u
#define BOARD_EVENT_COUNT 16384u

enum event_kind {
    EVENT_DAC = 1,      /* value: mirrors << 24 | word */
    EVENT_RAIL = 2,     /* value: 0 or 1 */
    EVENT_CLOCK = 3,    /* value: Hz */
    EVENT_TRIGGERS = 4, /* value: mask of the lines now high */
    EVENT_REBOOT = 5
};

struct event {
    uint64_t t_us;
    uint32_t kind;
    uint32_t value;
};

struct board {
    struct fovea fovea;
    uint64_t now_us;
    uint32_t noise;
    bool port_full;                    /* the host reads nothing */
    int64_t exposure_us[CAMERA_COUNT]; /* centre, left, right; negative: no strobe */
    int64_t delay_us[CAMERA_COUNT];    /* from trigger to strobe */
    uint64_t rise_us[CAMERA_COUNT];
    uint64_t fall_us[CAMERA_COUNT];
    uint8_t lines_high;
    size_t in_size;
    size_t out_size;
    size_t event_count;
    uint64_t events_lost;
    uint8_t in[BOARD_IN_SIZE];
    uint8_t out[BOARD_OUT_SIZE];
    struct event events[BOARD_EVENT_COUNT];
};

size_t board_size(void);
void board_init(struct board *board, uint64_t now_us, uint32_t noise);

/* Set a camera's strobe (0 centre, 1 left, 2 right): how long, and how late; a negative exposure shows none. */
void board_strobe(struct board *board, uint32_t camera, int64_t exposure_us, int64_t delay_us);
void board_fill_port(struct board *board, bool full);

/* Hand over bytes from the host; return how many fitted. They are read at the next board_settle or board_advance. */
size_t board_feed(struct board *board, const uint8_t *data, size_t size);

/* Poll until nothing more is due now. */
void board_settle(struct board *board);

/* Move the clock to `now_us`, from event to event. */
void board_advance(struct board *board, uint64_t now_us);

/* Return how long nothing happens by itself, us; UINT32_MAX = for ever. */
uint32_t board_idle_us(struct board *board);

/* Whether anything is under way but the watchdog and the once-a-second recovery. */
bool board_busy(struct board *board);

/* Whether packets carry a CRC now. */
bool board_crc(const struct board *board);

uint64_t board_now_us(const struct board *board);
size_t board_take(struct board *board, uint8_t *out, size_t size);
size_t board_events(struct board *board, struct event *events, size_t count);
uint64_t board_events_lost(const struct board *board);

#endif
