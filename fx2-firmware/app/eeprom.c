#include "app/eeprom.h"

#include "board/turret.h"
#include "drivers/i2c.h"

uint8_t eeprom_read(uint16_t address, uint8_t length)
{
    uint8_t i;

    i2c_bytes[0] = (uint8_t)(address >> 8);
    i2c_bytes[1] = (uint8_t)address;
    if (i2c_write(TURRET_EEPROM_ADDRESS, 2))
        return 0;
    for (i = 0; i != length; i++) {
        if (i2c_read(TURRET_EEPROM_ADDRESS))
            return 0;
        eeprom_data[i] = i2c_bytes[0];
    }
    return 1;
}
