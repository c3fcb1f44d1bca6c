/* Declarations with which a port is checked on a machine without its SDK: do our calls fit hal.h, and do the SDK's
 * functions, as documented, take what we give them? No code is made of this.
 */
#ifndef CHECK_SDK_H
#define CHECK_SDK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef unsigned int uint;
typedef struct spi_inst spi_inst_t;
typedef struct stdio_driver {
    void (*out_chars)(const char *buf, int len);
} stdio_driver_t;
typedef void (*gpio_irq_callback_t)(uint gpio, uint32_t event_mask);
enum gpio_function { GPIO_FUNC_SPI = 1, GPIO_FUNC_PWM = 4 };
enum gpio_irq_level { GPIO_IRQ_EDGE_FALL = 4, GPIO_IRQ_EDGE_RISE = 8 };
enum clock_index { clk_sys = 5 };
typedef enum { SPI_CPHA_0, SPI_CPHA_1 } spi_cpha_t;
typedef enum { SPI_CPOL_0, SPI_CPOL_1 } spi_cpol_t;
typedef enum { SPI_LSB_FIRST, SPI_MSB_FIRST } spi_order_t;
enum { PICO_ERROR_TIMEOUT = -1 };

extern spi_inst_t *const check_spi0;
#define spi0 check_spi0
extern stdio_driver_t stdio_usb;

uint32_t time_us_32(void);
uint32_t get_rand_32(void);
uint32_t clock_get_hz(enum clock_index clock);
void gpio_init(uint gpio);
void gpio_put(uint gpio, bool value);
bool gpio_get(uint gpio);
void gpio_set_dir(uint gpio, bool out);
void gpio_set_function(uint gpio, enum gpio_function fn);
void gpio_set_irq_enabled_with_callback(uint gpio, uint32_t events, bool enabled, gpio_irq_callback_t callback);
uint spi_init(spi_inst_t *spi, uint baudrate);
void spi_set_format(spi_inst_t *spi, uint data_bits, spi_cpol_t cpol, spi_cpha_t cpha, spi_order_t order);
int spi_write_blocking(spi_inst_t *spi, const uint8_t *src, size_t len);
uint pwm_gpio_to_slice_num(uint gpio);
void pwm_set_enabled(uint slice_num, bool enabled);
void pwm_set_clkdiv_int_frac(uint slice_num, uint8_t integer, uint8_t fract);
void pwm_set_wrap(uint slice_num, uint16_t wrap);
void pwm_set_gpio_level(uint gpio, uint16_t level);
bool stdio_usb_init(void);
bool stdio_usb_connected(void);
void stdio_set_translate_crlf(stdio_driver_t *driver, bool translate);
int getchar_timeout_us(uint32_t timeout_us);
void watchdog_enable(uint32_t delay_ms, bool pause_on_debug);
void watchdog_update(void);
void watchdog_reboot(uint32_t pc, uint32_t sp, uint32_t delay_ms);

#endif
