/* The firmware as a program, in real time: a controller to talk to without metal.
 *
 * fovea-controller [--pty] [--exposure-us N]
 * Speaks the protocol on stdin and stdout and tells its pins on stderr, one line an event; with --pty it opens a
 * pseudo-terminal, prints its path as the first line on stdout, tells its pins there, and ends with stdin.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "board.h"

#define CHUNK 4096u
#define LONGEST_WAIT_US 1000000u
#define STROBE_DELAY_US 150 /* behind the rise of the trigger line */

struct ports {
    int in;
    int out;
    int keep;    /* the pty's other end, held open so that a host may come and go; -1 on stdio */
    FILE *pins;
};

static struct board board;

static uint64_t now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

static void tell_pins(struct ports *ports)
{
    static const char *const names[] = {"", "dac", "rail", "clock", "triggers", "reboot"};
    static struct event events[256];
    size_t count;
    while ((count = board_events(&board, events, 256)) > 0) {
        for (size_t i = 0; i < count; i++) {
            fprintf(ports->pins, "%s %llu %08x\n", names[events[i].kind],
                    (unsigned long long)events[i].t_us, (unsigned)events[i].value);
        }
    }
    fflush(ports->pins);
}

/* What nobody reads is lost, as on a USB port that nobody has opened. */
static void send_all(struct ports *ports)
{
    static uint8_t out[CHUNK];
    size_t size;
    while ((size = board_take(&board, out, sizeof out)) > 0) {
        size_t sent = 0;
        while (sent < size) {
            ssize_t n = write(ports->out, out + sent, size - sent);
            if (n <= 0) {
                return;
            }
            sent += (size_t)n;
        }
    }
}

static bool receive(struct ports *ports)
{
    static uint8_t in[CHUNK];
    ssize_t size = read(ports->in, in, sizeof in);
    if (size > 0) {
        board_feed(&board, in, (size_t)size);
    }
    return size > 0 || (size < 0 && (errno == EAGAIN || errno == EINTR));
}

static void wait_for_work(struct ports *ports, struct pollfd *files, nfds_t count)
{
    uint32_t idle_us = board_idle_us(&board);
    idle_us = idle_us < LONGEST_WAIT_US ? idle_us : LONGEST_WAIT_US;
    struct timespec wait = {.tv_sec = idle_us / 1000000u, .tv_nsec = (long)(idle_us % 1000000u) * 1000};
    files[0].fd = ports->in;
    files[0].events = POLLIN;
    files[1].fd = STDIN_FILENO;
    files[1].events = POLLIN;
    if (ppoll(files, count, &wait, NULL) < 0) {
        files[0].revents = 0;
        files[1].revents = 0;
    }
}

static int run(struct ports *ports)
{
    struct pollfd files[2];
    char ignored[64];
    nfds_t count = ports->keep >= 0 ? 2 : 1;
    memset(files, 0, sizeof files);
    for (;;) {
        wait_for_work(ports, files, count);
        board_advance(&board, now_us()); /* first: what has arrived is stamped with the time that it is */
        if ((files[0].revents & (POLLIN | POLLHUP | POLLERR)) != 0 && !receive(ports)) {
            return 0;
        }
        if (count == 2 && files[1].revents != 0 && read(STDIN_FILENO, ignored, sizeof ignored) <= 0) {
            return 0;
        }
        board_advance(&board, now_us());
        send_all(ports);
        tell_pins(ports);
    }
}

static bool open_pty(struct ports *ports)
{
    struct termios raw;
    int master = posix_openpt(O_RDWR | O_NOCTTY);
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0) {
        return false;
    }
    const char *path = ptsname(master);
    int keep = path != NULL ? open(path, O_RDWR | O_NOCTTY) : -1;
    if (keep < 0 || tcgetattr(keep, &raw) != 0) {
        return false;
    }
    cfmakeraw(&raw);
    if (tcsetattr(keep, TCSANOW, &raw) != 0 || fcntl(master, F_SETFL, O_NONBLOCK) != 0) {
        return false;
    }
    *ports = (struct ports){.in = master, .out = master, .keep = keep, .pins = stdout};
    printf("%s\n", path);
    fflush(stdout);
    return true;
}

int main(int argc, char **argv)
{
    struct ports ports = {.in = STDIN_FILENO, .out = STDOUT_FILENO, .keep = -1, .pins = stderr};
    int64_t exposure_us = 5000;
    bool pty = false;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--pty") == 0) {
            pty = true;
        } else if (strcmp(argv[i], "--exposure-us") == 0 && i + 1 < argc) {
            exposure_us = strtoll(argv[++i], NULL, 10);
        } else {
            fprintf(stderr, "usage: %s [--pty] [--exposure-us N]\n", argv[0]);
            return 2;
        }
    }
    if (pty && !open_pty(&ports)) {
        perror("no pseudo-terminal");
        return 1;
    }
    board_init(&board, now_us(), (uint32_t)(now_us() & UINT32_MAX));
    board_strobe(&board, 1, exposure_us, STROBE_DELAY_US);
    board_strobe(&board, 2, exposure_us, STROBE_DELAY_US);
    return run(&ports);
}
