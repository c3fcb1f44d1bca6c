/* Plays recorded bytes and pauses to the core as fast as it can, for tests under a sanitizer.
 *
 * stdin: 'B' size u16 bytes | 'T' pause u32 us | 'N' (a new board). stdout: u32 kind << 28 | value for every event,
 * 0xF0000000 at every new board. Little endian.
 */
#include <stdio.h>
#include <string.h>

#include "board.h"

#define NEW_BOARD 0xF0000000u
#define SLICE_US 100000u

static struct board board;
static uint32_t noise = 1;

static void put_event(uint32_t word)
{
    uint8_t bytes[4];
    put_u32(bytes, word);
    fwrite(bytes, 1, sizeof bytes, stdout);
}

static void flush(void)
{
    static struct event events[BOARD_EVENT_COUNT];
    static uint8_t ignored[BOARD_OUT_SIZE];
    size_t count = board_events(&board, events, BOARD_EVENT_COUNT);
    for (size_t i = 0; i < count; i++) {
        put_event(events[i].kind << 28 | events[i].value);
    }
    board_take(&board, ignored, sizeof ignored);
}

/* In slices, so that no slice brings more events than a board remembers. */
static void pass(uint32_t pause_us)
{
    uint64_t end_us = board_now_us(&board) + pause_us;
    while (board_now_us(&board) < end_us) {
        uint64_t slice_us = board_now_us(&board) + SLICE_US;
        board_advance(&board, slice_us < end_us ? slice_us : end_us);
        flush();
    }
}

static void new_board(void)
{
    board_init(&board, noise * UINT64_C(0x9E3779B9), noise);
    noise++;
    board_strobe(&board, 1, 3000, 50);
    board_strobe(&board, 2, 3000, 70);
    put_event(NEW_BOARD);
}

static bool play(int kind)
{
    uint8_t head[4];
    static uint8_t bytes[UINT16_MAX];
    if (kind == 'N') {
        new_board();
    } else if (kind == 'T') {
        if (fread(head, 1, 4, stdin) != 4) {
            return false;
        }
        pass(get_u32(head));
    } else if (kind == 'B') {
        if (fread(head, 1, 2, stdin) != 2 || fread(bytes, 1, get_u16(head), stdin) != get_u16(head)) {
            return false;
        }
        board_feed(&board, bytes, get_u16(head));
        board_settle(&board);
    } else {
        return false;
    }
    flush();
    return board_events_lost(&board) == 0;
}

int main(void)
{
    int kind;
    new_board();
    while ((kind = getchar()) != EOF) {
        if (!play(kind)) {
            fprintf(stderr, "replay: the script breaks off, or too many events at once\n");
            return 1;
        }
    }
    return 0;
}
