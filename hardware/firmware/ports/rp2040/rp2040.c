/* Port to the RP2040 (Raspberry Pi Pico, its C SDK 1.5 or later). NEVER RUN ON A DEVICE, NEVER BUILT BY ITS TOOLS.
 *
 * Pins are a proposal. Before a mirror is connected: rail off in reset (a pull-down on ENABLE_PIN), SPI words and
 * both chip selects on a scope, trigger and strobe polarity, core/limits.h against the mirror's sheet. The port's
 * USB id is the SDK's, not the field controller's: name it by its path in the rig file.
 */
#include "firmware.h"

#include "hardware/clocks.h"
#include "hardware/gpio.h"
#include "hardware/pwm.h"
#include "hardware/spi.h"
#include "hardware/watchdog.h"
#include "pico/rand.h"
#include "pico/stdio_usb.h"
#include "pico/stdlib.h"

enum {
    ENABLE_PIN = 15,
    FILTER_CLOCK_PIN = 14,
    DAC_CLOCK_PIN = 18,
    DAC_DATA_PIN = 19,
    LEFT_SELECT_PIN = 17,
    RIGHT_SELECT_PIN = 16
};
static const uint TRIGGER_PINS[CAMERA_COUNT] = {2, 3, 4}; /* centre, left, right */
static const uint STROBE_PINS[CAMERA_COUNT] = {6, 7, 8};
static const bool STROBE_ACTIVE = true; /* false behind an opto-coupler that pulls low */
static const bool CENTRE_STROBE = false;

#define DAC_HZ 2000000u
#define HANG_MS 100u /* a loop that stands still so long restarts the processor, and the rail goes off */
#define SLOW_CLOCK_HZ 2000u
#define SLOW_DIVIDER 64u

static struct fovea fovea;

static uint32_t board_micros(void *board)
{
    (void)board;
    return time_us_32();
}

static void board_dac(void *board, uint8_t mirrors, uint32_t word)
{
    const uint8_t bytes[3] = {(uint8_t)(word >> 16), (uint8_t)(word >> 8 & 0xFFu), (uint8_t)(word & 0xFFu)};
    (void)board;
    gpio_put(LEFT_SELECT_PIN, (mirrors & MIRROR_LEFT) == 0);
    gpio_put(RIGHT_SELECT_PIN, (mirrors & MIRROR_RIGHT) == 0);
    spi_write_blocking(spi0, bytes, sizeof bytes);
    gpio_put(LEFT_SELECT_PIN, true);
    gpio_put(RIGHT_SELECT_PIN, true);
}

static void board_rail(void *board, bool on)
{
    (void)board;
    gpio_put(ENABLE_PIN, on);
}

static void board_filter_clock(void *board, uint32_t clock_hz)
{
    uint slice = pwm_gpio_to_slice_num(FILTER_CLOCK_PIN);
    (void)board;
    if (clock_hz == 0) {
        pwm_set_enabled(slice, false);
        return;
    }
    uint32_t divider = clock_hz < SLOW_CLOCK_HZ ? SLOW_DIVIDER : 1u; /* the counter has 16 bits */
    uint32_t period = clock_get_hz(clk_sys) / divider / clock_hz;
    period = period < 2u ? 2u : period;
    pwm_set_clkdiv_int_frac(slice, (uint8_t)divider, 0);
    pwm_set_wrap(slice, (uint16_t)(period - 1u));
    pwm_set_gpio_level(FILTER_CLOCK_PIN, (uint16_t)(period / 2u));
    pwm_set_enabled(slice, true);
}

static void board_triggers(void *board, uint8_t high)
{
    (void)board;
    for (uint i = 0; i < CAMERA_COUNT; i++) {
        gpio_put(TRIGGER_PINS[i], (high >> i & 1u) != 0);
    }
}

/* The SDK's USB output waits a little for a full port (PICO_STDIO_USB_STDOUT_TIMEOUT_US), then drops. */
static bool board_send(void *board, const uint8_t *data, size_t size)
{
    (void)board;
    if (!stdio_usb_connected()) {
        return false;
    }
    stdio_usb.out_chars((const char *)data, (int)size); /* at once: putchar sends a USB packet a byte */
    return true;
}

static uint32_t board_entropy(void *board)
{
    (void)board;
    return get_rand_32();
}

static void board_reboot(void *board)
{
    (void)board;
    watchdog_reboot(0, 0, 0);
}

static void on_strobe(uint pin, uint32_t events)
{
    uint32_t t_us = time_us_32();
    (void)events;
    for (uint i = 0; i < CAMERA_COUNT; i++) {
        if (STROBE_PINS[i] == pin) {
            fovea_strobe(&fovea, (uint8_t)(1u << i), gpio_get(pin) == STROBE_ACTIVE, t_us);
        }
    }
}

static void set_up_output(uint pin, bool level)
{
    gpio_init(pin);
    gpio_put(pin, level);
    gpio_set_dir(pin, true);
}

static void set_up_pins(void)
{
    set_up_output(ENABLE_PIN, false);
    set_up_output(LEFT_SELECT_PIN, true);
    set_up_output(RIGHT_SELECT_PIN, true);
    gpio_set_function(FILTER_CLOCK_PIN, GPIO_FUNC_PWM);
    gpio_set_function(DAC_CLOCK_PIN, GPIO_FUNC_SPI);
    gpio_set_function(DAC_DATA_PIN, GPIO_FUNC_SPI);
    spi_init(spi0, DAC_HZ);
    spi_set_format(spi0, 8, SPI_CPOL_0, SPI_CPHA_1, SPI_MSB_FIRST); /* data at the falling edge */
    for (uint i = 0; i < CAMERA_COUNT; i++) {
        set_up_output(TRIGGER_PINS[i], false);
        gpio_init(STROBE_PINS[i]);
        if (i != 0 || CENTRE_STROBE) { /* an open input would report edges that are none */
            gpio_set_irq_enabled_with_callback(STROBE_PINS[i], GPIO_IRQ_EDGE_RISE | GPIO_IRQ_EDGE_FALL, true,
                                               on_strobe);
        }
    }
}

int main(void)
{
    const struct fovea_hal hal = {
        .micros = board_micros,
        .dac = board_dac,
        .rail = board_rail,
        .filter_clock = board_filter_clock,
        .triggers = board_triggers,
        .send = board_send,
        .entropy = board_entropy,
        .reboot = board_reboot,
        .centre_strobe = CENTRE_STROBE,
    };
    set_up_pins();
    stdio_usb_init();
    stdio_set_translate_crlf(&stdio_usb, false);
    fovea_boot(&fovea, &hal);
    watchdog_enable(HANG_MS, true);
    int held = PICO_ERROR_TIMEOUT; /* a byte that there was no room for */
    for (;;) {
        watchdog_update();
        held = held >= 0 ? held : getchar_timeout_us(0);
        uint8_t byte = (uint8_t)held;
        if (held >= 0 && fovea_receive(&fovea, &byte, 1) == 1) {
            held = PICO_ERROR_TIMEOUT;
        }
        fovea_poll(&fovea);
    }
}
