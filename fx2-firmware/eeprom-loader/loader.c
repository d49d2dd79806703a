#include "eeprom-loader/loader.h"

#include "board/turret.h"
#include "drivers/usb.h"
#include "eeprom-loader/writer.h"
#include "link/eeprom.h"

enum { VENDOR_TO_DEVICE = 0x40, VENDOR_FROM_DEVICE = 0xC0 };

static uint8_t result = LOADER_OK; /* of the last request that was not for the status */
static uint8_t begun;
static uint8_t waiting; /* the data of a WRITE are on their way */
static XDATA uint8_t first_byte;

static void answer(uint8_t length)
{
    if (usb_setup.length < length)
        length = (uint8_t)usb_setup.length;
    usb_control_send(usb_control_data, length, length < usb_setup.length);
}

static void send_status(void)
{
    usb_control_data[0] = LOADER_VERSION;
    usb_control_data[1] = result;
    usb_control_data[2] = begun;
    usb_control_data[3] = 0;
    answer(LOADER_STATUS_SIZE);
}

static uint8_t put_first_byte(uint8_t value)
{
    first_byte = value;
    return writer_write(0, &first_byte, 1);
}

static uint8_t begin(void)
{
    uint8_t error;

    if (usb_setup.value != 0 || usb_setup.index != 0 || usb_setup.length != 0)
        return LOADER_REFUSED;
    error = put_first_byte(EEPROM_BLANK);
    begun = !error;
    return error;
}

static uint8_t check_write(void)
{
    uint16_t within_page = usb_setup.value & (EEPROM_PAGE - 1u);

    if (usb_setup.index != 0 || usb_setup.length == 0 ||
        usb_setup.length > EEPROM_PAGE - within_page || usb_setup.value >= TURRET_EEPROM_SIZE)
        return LOADER_REFUSED;
    if (usb_setup.value < EEPROM_SERIAL_AT && !begun)
        return LOADER_NOT_BEGUN;
    return LOADER_OK;
}

static uint8_t write(void)
{
    if (usb_setup.value == 0)
        usb_control_data[0] = EEPROM_BLANK;
    return writer_write(usb_setup.value, usb_control_data, (uint8_t)usb_setup.length);
}

static uint8_t commit(void)
{
    uint8_t error;

    if (usb_setup.length != 0 || usb_setup.value == 0 || usb_setup.value > EEPROM_SERIAL_AT)
        return LOADER_REFUSED;
    if (!begun)
        return LOADER_NOT_BEGUN;
    error = writer_check(usb_setup.value, EEPROM_BOOT, usb_setup.index);
    if (error)
        return error;
    begun = 0;
    return put_first_byte(EEPROM_BOOT);
}

static uint8_t read(void)
{
    if (usb_setup.index != 0 || usb_setup.length == 0 || usb_setup.length > EEPROM_PAGE ||
        usb_setup.value >= TURRET_EEPROM_SIZE)
        return LOADER_REFUSED;
    return writer_read(usb_setup.value, usb_control_data, (uint8_t)usb_setup.length);
}

static void conclude(uint8_t error)
{
    result = error;
    if (error)
        usb_control_stall();
    else
        usb_control_acknowledge();
}

static void handle_out(void)
{
    switch (usb_setup.number) {
    case REQUEST_LOADER_BEGIN:
        conclude(begin());
        break;
    case REQUEST_LOADER_WRITE:
        result = check_write();
        waiting = !result;
        if (waiting)
            usb_control_receive();
        else
            usb_control_stall();
        break;
    case REQUEST_LOADER_COMMIT:
        conclude(commit());
        break;
    default:
        usb_control_stall();
        break;
    }
}

static void handle_in(void)
{
    if (usb_setup.number == REQUEST_LOADER_STATUS && usb_setup.value == 0 && usb_setup.index == 0 &&
        usb_setup.length != 0) {
        send_status();
        return;
    }
    if (usb_setup.number == REQUEST_LOADER_READ) {
        result = read();
        if (result == LOADER_OK) {
            answer((uint8_t)usb_setup.length);
            return;
        }
    }
    usb_control_stall();
}

static void handle_setup(void)
{
    waiting = 0;
    usb_read_setup();
    if (usb_setup.type == VENDOR_TO_DEVICE)
        handle_out();
    else if (usb_setup.type == VENDOR_FROM_DEVICE)
        handle_in();
    else
        usb_control_stall();
}

uint8_t loader_poll(void)
{
    uint8_t events = usb_take_events();

    if (events & USB_EVENT_SETUP)
        handle_setup();
    if (waiting && usb_control_received()) {
        waiting = 0;
        conclude(write());
    }
    return (events & USB_EVENT_RESET) != 0;
}
