/* A board without metal. */
#include "board.h"

#include <string.h>

#include "parts.h"

#define HEARTBEAT_US (1u << 30) /* an idle core is polled so often at least, as on metal: its clock wraps */

static struct board *board_of(void *board)
{
    return board;
}

static void note(struct board *board, enum event_kind kind, uint32_t value)
{
    if (board->event_count == BOARD_EVENT_COUNT) {
        board->events_lost++;
        return;
    }
    struct event *event = &board->events[board->event_count++];
    event->t_us = board->now_us;
    event->kind = kind;
    event->value = value;
}

static uint32_t micros(void *context)
{
    return (uint32_t)(board_of(context)->now_us & UINT32_MAX);
}

static void dac(void *context, uint8_t mirrors, uint32_t word)
{
    note(board_of(context), EVENT_DAC, (uint32_t)mirrors << 24 | word);
}

static void rail(void *context, bool on)
{
    note(board_of(context), EVENT_RAIL, on);
}

static void filter_clock(void *context, uint32_t clock_hz)
{
    note(board_of(context), EVENT_CLOCK, clock_hz);
}

/* A camera starts to expose at a rising edge of its trigger, unless it is exposing. */
static void triggers(void *context, uint8_t high)
{
    struct board *board = board_of(context);
    uint8_t rising = high & (uint8_t)~board->lines_high;
    board->lines_high = high;
    note(board, EVENT_TRIGGERS, high);
    for (unsigned i = 0; i < CAMERA_COUNT; i++) {
        if ((rising & 1u << i) != 0 && board->exposure_us[i] >= 0 && board->fall_us[i] == NEVER_US) {
            board->rise_us[i] = board->now_us + (uint64_t)board->delay_us[i];
            board->fall_us[i] = board->rise_us[i] + (uint64_t)board->exposure_us[i];
        }
    }
}

static bool send(void *context, const uint8_t *data, size_t size)
{
    struct board *board = board_of(context);
    if (board->port_full || size > sizeof board->out - board->out_size) {
        return false;
    }
    memcpy(board->out + board->out_size, data, size);
    board->out_size += size;
    return true;
}

static uint32_t entropy(void *context)
{
    struct board *board = board_of(context);
    board->noise = board->noise * 1664525u + 1013904223u;
    return board->noise;
}

static void reboot(void *context)
{
    note(board_of(context), EVENT_REBOOT, 0);
}

size_t board_size(void)
{
    return sizeof(struct board);
}

void board_init(struct board *board, uint64_t now_us, uint32_t noise)
{
    memset(board, 0, sizeof *board);
    board->now_us = now_us;
    board->noise = noise;
    for (unsigned i = 0; i < CAMERA_COUNT; i++) {
        board->exposure_us[i] = -1;
        board->rise_us[i] = NEVER_US;
        board->fall_us[i] = NEVER_US;
    }
    struct fovea_hal hal = {
        .board = board,
        .micros = micros,
        .dac = dac,
        .rail = rail,
        .filter_clock = filter_clock,
        .triggers = triggers,
        .send = send,
        .entropy = entropy,
        .reboot = reboot,
        .centre_strobe = false,
    };
    fovea_boot(&board->fovea, &hal);
}

void board_strobe(struct board *board, uint32_t camera, int64_t exposure_us, int64_t delay_us)
{
    if (camera < CAMERA_COUNT) {
        board->exposure_us[camera] = exposure_us;
        board->delay_us[camera] = delay_us;
    }
}

void board_fill_port(struct board *board, bool full)
{
    board->port_full = full;
}

size_t board_feed(struct board *board, const uint8_t *data, size_t size)
{
    size_t room = sizeof board->in - board->in_size;
    size_t taken = size < room ? size : room;
    memcpy(board->in + board->in_size, data, taken);
    board->in_size += taken;
    return taken;
}

static void hand_over(struct board *board)
{
    size_t taken = fovea_receive(&board->fovea, board->in, board->in_size);
    board->in_size -= taken;
    memmove(board->in, board->in + taken, board->in_size);
}

static void strobe(struct board *board)
{
    for (unsigned i = 0; i < CAMERA_COUNT; i++) {
        uint8_t camera = (uint8_t)(1u << i);
        if (board->rise_us[i] <= board->now_us) {
            fovea_strobe(&board->fovea, camera, true, (uint32_t)(board->rise_us[i] & UINT32_MAX));
            board->rise_us[i] = NEVER_US;
        }
        if (board->rise_us[i] == NEVER_US && board->fall_us[i] <= board->now_us) {
            fovea_strobe(&board->fovea, camera, false, (uint32_t)(board->fall_us[i] & UINT32_MAX));
            board->fall_us[i] = NEVER_US;
        }
    }
}

uint32_t board_idle_us(struct board *board)
{
    uint64_t due_us = NEVER_US;
    for (unsigned i = 0; i < CAMERA_COUNT; i++) {
        uint64_t edge_us = board->rise_us[i] < board->fall_us[i] ? board->rise_us[i] : board->fall_us[i];
        due_us = edge_us < due_us ? edge_us : due_us;
    }
    uint64_t strobe_us = due_us == NEVER_US ? UINT32_MAX : due_us > board->now_us ? due_us - board->now_us : 0;
    uint32_t core_us = fovea_idle_us(&board->fovea);
    return strobe_us < core_us ? (uint32_t)strobe_us : core_us;
}

bool board_busy(struct board *board)
{
    const struct fovea *fovea = &board->fovea;
    bool switching = fovea->guard.power != POWER_ON && fovea->guard.power != POWER_OFF;
    bool strobing = false;
    for (unsigned i = 0; i < CAMERA_COUNT; i++) {
        strobing = strobing || board->fall_us[i] != NEVER_US;
    }
    return switching || strobing || fovea->frames.phase != FRAME_NONE || lines_due_us(fovea) != NEVER_US ||
           pending_due_us(fovea) != NEVER_US || board_idle_us(board) == 0;
}

bool board_crc(const struct board *board)
{
    return board->fovea.link.crc;
}

void board_settle(struct board *board)
{
    do {
        hand_over(board);
        strobe(board);
        fovea_poll(&board->fovea);
    } while (board_idle_us(board) == 0 || (board->in_size > 0 && !guard_blocked(&board->fovea)));
}

void board_advance(struct board *board, uint64_t now_us)
{
    board_settle(board);
    for (;;) {
        uint32_t idle_us = board_idle_us(board);
        idle_us = idle_us < HEARTBEAT_US ? idle_us : HEARTBEAT_US;
        if (board->now_us + idle_us > now_us) {
            break;
        }
        board->now_us += idle_us;
        board_settle(board);
    }
    board->now_us = now_us > board->now_us ? now_us : board->now_us;
    board_settle(board);
}

uint64_t board_now_us(const struct board *board)
{
    return board->now_us;
}

size_t board_take(struct board *board, uint8_t *out, size_t size)
{
    size_t taken = board->out_size < size ? board->out_size : size;
    memcpy(out, board->out, taken);
    board->out_size -= taken;
    memmove(board->out, board->out + taken, board->out_size);
    return taken;
}

size_t board_events(struct board *board, struct event *events, size_t count)
{
    size_t taken = board->event_count < count ? board->event_count : count;
    memcpy(events, board->events, taken * sizeof *events);
    board->event_count -= taken;
    memmove(board->events, board->events + taken, board->event_count * sizeof *events);
    return taken;
}

uint64_t board_events_lost(const struct board *board)
{
    return board->events_lost;
}
