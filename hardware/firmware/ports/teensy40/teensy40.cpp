/* Port to the Teensy 4.0 of the paper's rig (Arduino, Teensyduino). NEVER RUN ON A DEVICE, NEVER BUILT BY ITS TOOLS.
 *
 * Pins are the rig's published wiring. Before a mirror is connected: rail off in reset (a pull-down on ENABLE_PIN),
 * SPI words and both chip selects on a scope, trigger and strobe polarity, core/limits.h against the mirror's sheet.
 */
#include <Arduino.h>
#include <EEPROM.h>
#include <SPI.h>

extern "C" {
#include "firmware.h"
}

static const uint8_t ENABLE_PIN = 15;
static const uint8_t LEFT_SELECT_PIN = 9; /* SPI data 11, clock 13 */
static const uint8_t RIGHT_SELECT_PIN = 10;
static const uint8_t FILTER_CLOCK_PIN = 14;
static const uint8_t TRIGGER_PINS[CAMERA_COUNT] = {20, 22, 18}; /* centre, left, right */
static const uint8_t STROBE_PINS[CAMERA_COUNT] = {21, 23, 19};
/* Unverified: an opto-coupled output behind a pull-up reads low while the camera exposes; say LOW here then. */
static const uint8_t STROBE_ACTIVE = HIGH;
static const bool CENTRE_STROBE = false;
static const int BOOT_COUNT_ADDRESS = 0;

/* 2 MHz as on the rig; the DAC takes data at the clock's falling edge. */
static const SPISettings DAC_BUS(2000000, MSBFIRST, SPI_MODE1);

static struct fovea fovea;

static uint32_t board_micros(void *)
{
    return micros();
}

static void board_dac(void *, uint8_t mirrors, uint32_t word)
{
    SPI.beginTransaction(DAC_BUS);
    digitalWriteFast(LEFT_SELECT_PIN, (mirrors & MIRROR_LEFT) ? LOW : HIGH);
    digitalWriteFast(RIGHT_SELECT_PIN, (mirrors & MIRROR_RIGHT) ? LOW : HIGH);
    SPI.transfer((word >> 16) & 0xFF);
    SPI.transfer((word >> 8) & 0xFF);
    SPI.transfer(word & 0xFF);
    digitalWriteFast(LEFT_SELECT_PIN, HIGH);
    digitalWriteFast(RIGHT_SELECT_PIN, HIGH);
    SPI.endTransaction();
}

static void board_rail(void *, bool on)
{
    digitalWriteFast(ENABLE_PIN, on ? HIGH : LOW);
}

static void board_filter_clock(void *, uint32_t clock_hz)
{
    if (clock_hz == 0) {
        analogWrite(FILTER_CLOCK_PIN, 0);
    } else {
        analogWriteFrequency(FILTER_CLOCK_PIN, clock_hz);
        analogWrite(FILTER_CLOCK_PIN, 128); /* half of 256 */
    }
}

static void board_triggers(void *, uint8_t high)
{
    for (uint8_t i = 0; i < CAMERA_COUNT; i++) {
        digitalWriteFast(TRIGGER_PINS[i], (high >> i & 1) ? HIGH : LOW);
    }
}

static bool board_send(void *, const uint8_t *data, size_t size)
{
    if (!Serial || (size_t)Serial.availableForWrite() < size) {
        return false;
    }
    Serial.write(data, size);
    Serial.send_now();
    return true;
}

static uint32_t board_entropy(void *)
{
    uint32_t count;
    EEPROM.get(BOOT_COUNT_ADDRESS, count);
    count++;
    EEPROM.put(BOOT_COUNT_ADDRESS, count);
    return count * 2654435761u; /* odd: no two counts fall together */
}

static void board_reboot(void *)
{
    SCB_AIRCR = 0x05FA0004;
}

static void strobe(unsigned camera)
{
    uint32_t t_us = micros();
    bool exposing = digitalReadFast(STROBE_PINS[camera]) == STROBE_ACTIVE;
    fovea_strobe(&fovea, 1u << camera, exposing, t_us);
}

static void strobe_centre() { strobe(0); }
static void strobe_left() { strobe(1); }
static void strobe_right() { strobe(2); }

static void set_up_pins()
{
    static void (*const edges[CAMERA_COUNT])() = {strobe_centre, strobe_left, strobe_right};
    digitalWrite(ENABLE_PIN, LOW);
    pinMode(ENABLE_PIN, OUTPUT);
    digitalWrite(LEFT_SELECT_PIN, HIGH);
    digitalWrite(RIGHT_SELECT_PIN, HIGH);
    pinMode(LEFT_SELECT_PIN, OUTPUT);
    pinMode(RIGHT_SELECT_PIN, OUTPUT);
    pinMode(FILTER_CLOCK_PIN, OUTPUT);
    for (uint8_t i = 0; i < CAMERA_COUNT; i++) {
        pinMode(TRIGGER_PINS[i], OUTPUT);
        pinMode(STROBE_PINS[i], INPUT);
        if (i != 0 || CENTRE_STROBE) { /* an open input would report edges that are none */
            attachInterrupt(digitalPinToInterrupt(STROBE_PINS[i]), edges[i], CHANGE);
        }
    }
}

void setup()
{
    set_up_pins();
    SPI.begin();
    Serial.begin(115200);
    struct fovea_hal hal = {};
    hal.micros = board_micros;
    hal.dac = board_dac;
    hal.rail = board_rail;
    hal.filter_clock = board_filter_clock;
    hal.triggers = board_triggers;
    hal.send = board_send;
    hal.entropy = board_entropy;
    hal.reboot = board_reboot;
    hal.centre_strobe = CENTRE_STROBE;
    fovea_boot(&fovea, &hal);
}

void loop()
{
    while (Serial.available() > 0) {
        uint8_t byte = (uint8_t)Serial.peek();
        if (fovea_receive(&fovea, &byte, 1) == 0) {
            break; /* full: the USB host waits */
        }
        Serial.read();
    }
    fovea_poll(&fovea);
}
