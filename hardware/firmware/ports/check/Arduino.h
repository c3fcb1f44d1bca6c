/* Declarations with which the Teensy port is checked on a machine without Teensyduino; no code is made of this. */
#ifndef CHECK_ARDUINO_H
#define CHECK_ARDUINO_H

#include <stddef.h>
#include <stdint.h>

enum { LOW, HIGH };
enum { INPUT, OUTPUT };
enum { CHANGE = 4 };
enum { MSBFIRST = 1, SPI_MODE1 = 4 };

uint32_t micros(void);
void pinMode(uint8_t pin, uint8_t mode);
void digitalWrite(uint8_t pin, uint8_t value);
void digitalWriteFast(uint8_t pin, uint8_t value);
uint8_t digitalReadFast(uint8_t pin);
void analogWrite(uint8_t pin, int value);
void analogWriteFrequency(uint8_t pin, float frequency_hz);
void attachInterrupt(uint8_t pin, void (*function)(void), int mode);
#define digitalPinToInterrupt(pin) (pin)

class usb_serial_class
{
  public:
    void begin(long baud);
    int available();
    int peek();
    int read();
    int availableForWrite();
    size_t write(const uint8_t *data, size_t size);
    void send_now();
    operator bool();
};
extern usb_serial_class Serial;
extern volatile uint32_t SCB_AIRCR;

class SPISettings
{
  public:
    SPISettings(uint32_t clock, uint8_t order, uint8_t mode);
};

class SPIClass
{
  public:
    void begin();
    void beginTransaction(SPISettings settings);
    uint8_t transfer(uint8_t data);
    void endTransaction();
};
extern SPIClass SPI;

struct EEPROMClass {
    template <typename T> T &get(int address, T &value);
    template <typename T> const T &put(int address, const T &value);
};
extern EEPROMClass EEPROM;

#endif
