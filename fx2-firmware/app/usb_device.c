#include "app/usb_device.h"

#include "app/cameras.h"
#include "app/configure.h"
#include "app/descriptors.h"
#include "app/eeprom.h"
#include "app/flash_chip.h"
#include "app/slot_store.h"
#include "app/store.h"
#include "app/stream.h"
#include "drivers/flash_bus.h"
#include "drivers/i2c.h"
#include "drivers/spi.h"
#include "drivers/usb.h"
#include "drivers/usb_bulk.h"
#include "link/registers.h"
#include "link/requests.h"
#include "link/slots.h"

#include <stddef.h>

/* bmRequestType: direction, kind and recipient in one. */
enum {
    TO_DEVICE = 0x00,
    TO_INTERFACE = 0x01,
    TO_ENDPOINT = 0x02,
    FROM_DEVICE = 0x80,
    FROM_INTERFACE = 0x81,
    FROM_ENDPOINT = 0x82,
    VENDOR_TO_DEVICE = 0x40,
    VENDOR_FROM_DEVICE = 0xC0
};

/* bRequest of the standard requests. SET_ADDRESS the hardware answers. */
enum {
    GET_STATUS = 0,
    CLEAR_FEATURE = 1,
    SET_FEATURE = 3,
    GET_DESCRIPTOR = 6,
    GET_CONFIGURATION = 8,
    SET_CONFIGURATION = 9,
    GET_INTERFACE = 10,
    SET_INTERFACE = 11
};

#define STATUS_SELF_POWERED 1u

static uint8_t configuration; /* 0 = not configured */
static uint8_t alternate;     /* USB_ALTERNATE_* of interface 0 */
static XDATA uint8_t reply[CAMERAS_STATUS_SIZE];

/* The handlers below answer and return 1, or return 0 for a request to be refused. What the table
 * at the end demands of a request, they need not look at. */

static uint8_t answer(const XDATA uint8_t *data, uint8_t length)
{
    if (usb_setup.length == 0)
        usb_control_acknowledge();
    else if (length < usb_setup.length)
        usb_control_send(data, length, 1);
    else
        usb_control_send(data, (uint8_t)usb_setup.length, 0);
    return 1;
}

static uint8_t answer_byte(uint8_t value)
{
    reply[0] = value;
    return answer(reply, 1);
}

static uint8_t acknowledge(void)
{
    usb_control_acknowledge();
    return 1;
}

static uint8_t get_descriptor(void)
{
    const XDATA uint8_t *data =
        descriptor_find((uint8_t)(usb_setup.value >> 8), (uint8_t)usb_setup.value);

    if (data == NULL)
        return 0;
    return answer(data, descriptor_length);
}

static uint8_t answer_status(uint8_t status)
{
    reply[0] = status;
    reply[1] = 0;
    return answer(reply, 2);
}

static uint8_t get_device_status(void)
{
    return answer_status(STATUS_SELF_POWERED);
}

static uint8_t get_interface_status(void)
{
    return answer_status(0);
}

/* An endpoint's address, 0 for endpoint 0 in either direction. */
static uint8_t endpoint(void)
{
    return usb_setup.index == 0x80u ? 0 : (uint8_t)usb_setup.index;
}

static uint8_t get_endpoint_status(void)
{
    if (endpoint() == 0)
        return answer_status(0);
    return answer_status(usb_bulk_is_halted(endpoint()));
}

/* Endpoint 0 never halts: to halt it would be of no use, to end its halt does no harm. */
static uint8_t set_halt(void)
{
    if (endpoint() == 0)
        return 0;
    usb_bulk_halt(endpoint(), 1);
    return acknowledge();
}

static uint8_t clear_halt(void)
{
    if (endpoint() != 0)
        usb_bulk_halt(endpoint(), 0);
    return acknowledge();
}

static uint8_t job_is_busy(void)
{
    return configure_busy() | store_busy();
}

/* The flash's and the FPGA's own jobs take their course. */
static void abort_data_jobs(void)
{
    configure_abort();
    store_abort();
}

/* Endpoint 02 is there in settings 1 and 2. */
static uint8_t sink_exists(void)
{
    return (alternate + 1u) & 2u;
}

static void choose_alternate(uint8_t setting)
{
    abort_data_jobs();
    if (alternate == USB_ALTERNATE_STREAM)
        stream_close();
    alternate = setting;
    usb_bulk_open();
    if (!sink_exists())
        usb_bulk_close();
    if (setting == USB_ALTERNATE_SOURCE_SINK)
        usb_bulk_arm();
    if (setting == USB_ALTERNATE_STREAM)
        stream_open();
}

static void configure_device(uint8_t value)
{
    configuration = value;
    choose_alternate(USB_ALTERNATE_CONTROL);
}

static uint8_t get_configuration(void)
{
    return answer_byte(configuration);
}

static uint8_t set_configuration(void)
{
    if (usb_setup.value > USB_CONFIGURATION_VALUE)
        return 0;
    configure_device((uint8_t)usb_setup.value);
    return acknowledge();
}

static uint8_t get_interface(void)
{
    return answer_byte(alternate);
}

/* Jobs of the flash and the FPGA need the pins and the buffers that 1 and 3 use. */
static uint8_t set_interface(void)
{
    uint8_t setting = (uint8_t)usb_setup.value;

    if (usb_setup.value > USB_ALTERNATE_STREAM || (setting & 1u && job_is_busy()))
        return 0;
    choose_alternate(setting);
    return acknowledge();
}

static uint8_t config_status(void)
{
    return answer(configure_status(), CONFIG_STATUS_SIZE);
}

static uint8_t config_begin(void)
{
    if (usb_setup.value > CONFIG_BEGIN_PARTIAL || !configure_from_usb((uint8_t)usb_setup.value))
        return 0;
    return acknowledge();
}

static uint8_t abort_job(void)
{
    abort_data_jobs();
    return acknowledge();
}

static uint8_t config_boot(void)
{
    if (usb_setup.value & ~(SLOT_COUNT - 1u) && usb_setup.value != CONFIG_BOOT_DEFAULT)
        return 0;
    configure_from_flash((uint8_t)usb_setup.value);
    return acknowledge();
}

static uint8_t get_store_status(void)
{
    return answer(store_status(), STORE_STATUS_SIZE);
}

static uint8_t begin_store_job(void)
{
    if (!store_begin())
        return 0;
    return acknowledge();
}

static uint8_t answer_eeprom(void)
{
    if ((uint16_t)(usb_setup.length - 1u) >= EEPROM_READ_MAX ||
        !eeprom_read(usb_setup.value, (uint8_t)usb_setup.length))
        return 0;
    return answer(eeprom_data, (uint8_t)usb_setup.length);
}

static uint8_t microsoft_descriptor(void)
{
    const XDATA uint8_t *set = descriptor_microsoft();

    if (usb_setup.index != MICROSOFT_DESCRIPTOR_INDEX)
        return 0;
    return answer(set, descriptor_length);
}

/* wIndex names a register, and port C is not needed by the flash. */
static uint8_t fpga_registers_reachable(void)
{
    if (usb_setup.index & ~(FPGA_REG_COUNT - 1u))
        return 0;
    return !flash_bus_is_selected();
}

static uint8_t read_fpga_register(void)
{
    uint16_t value;

    if (!fpga_registers_reachable())
        return 0;
    value = spi_register_read((uint8_t)usb_setup.index);
    reply[0] = (uint8_t)(value >> 8);
    reply[1] = (uint8_t)value;
    return answer(reply, 2);
}

static uint8_t write_fpga_register(void)
{
    if (!fpga_registers_reachable() ||
        ((uint8_t)usb_setup.index == FPGA_REG_STREAM && alternate != USB_ALTERNATE_STREAM))
        return 0;
    spi_register_write((uint8_t)usb_setup.index, usb_setup.value);
    return acknowledge();
}

static uint8_t read_camera(void)
{
    if (usb_setup.index >> 8 >= CAMERA_COUNT ||
        camera_read((uint8_t)(usb_setup.index >> 8), (uint8_t)usb_setup.index))
        return 0;
    return answer_byte(i2c_bytes[0]);
}

static uint8_t write_camera(void)
{
    if (usb_setup.index >> 8 >= CAMERA_COUNT || usb_setup.value >> 8 != 0 ||
        camera_write((uint8_t)(usb_setup.index >> 8), (uint8_t)usb_setup.index,
                     (uint8_t)usb_setup.value))
        return 0;
    return acknowledge();
}

static uint8_t setup_cameras(void)
{
    if (flash_bus_is_selected())
        return 0;
    cameras_setup();
    return acknowledge();
}

static uint8_t get_cameras_status(void)
{
    reply[0] = CAMERAS_STATUS_VERSION;
    reply[1] = cameras_status[0];
    reply[2] = cameras_status[1];
    reply[3] = 0;
    return answer(reply, CAMERAS_STATUS_SIZE);
}

/* What a request must be like. */
enum {
    VALUE_0 = 0x01,    /* wValue = 0 */
    INDEX_0 = 0x02,    /* wIndex = 0: the device, or interface 0 */
    ENDPOINT = 0x04,   /* wIndex names an endpoint that there is now */
    NO_DATA = 0x08,    /* wLength = 0 */
    CONFIGURED = 0x10, /* the device is configured: only then there is an interface */
    HEADER = 0x20,     /* a slot header comes as data: the handler finds it in flash_page */
    JOB = 0x40,        /* no job is busy, and the setting is one that allows them */
    DATA = 0x80        /* the setting is the one with the endpoints for it */
};

typedef struct {
    uint8_t type;
    uint8_t number;
    uint8_t demands;
    uint8_t (*handle)(void);
} request_t;

/* Every request we know. The only feature of an endpoint is ENDPOINT_HALT, 0. */
static const CODE request_t requests[] = {
    {FROM_DEVICE, GET_DESCRIPTOR, 0, get_descriptor},
    {FROM_DEVICE, GET_CONFIGURATION, VALUE_0 | INDEX_0, get_configuration},
    {FROM_DEVICE, GET_STATUS, VALUE_0 | INDEX_0, get_device_status},
    {FROM_INTERFACE, GET_STATUS, VALUE_0 | INDEX_0 | CONFIGURED, get_interface_status},
    {FROM_INTERFACE, GET_INTERFACE, VALUE_0 | INDEX_0 | CONFIGURED, get_interface},
    {FROM_ENDPOINT, GET_STATUS, VALUE_0 | ENDPOINT, get_endpoint_status},
    {TO_DEVICE, SET_CONFIGURATION, INDEX_0 | NO_DATA, set_configuration},
    {TO_INTERFACE, SET_INTERFACE, INDEX_0 | NO_DATA | CONFIGURED, set_interface},
    {TO_ENDPOINT, CLEAR_FEATURE, VALUE_0 | ENDPOINT | NO_DATA, clear_halt},
    {TO_ENDPOINT, SET_FEATURE, VALUE_0 | ENDPOINT | NO_DATA, set_halt},
    {VENDOR_FROM_DEVICE, REQUEST_CONFIG_STATUS, VALUE_0 | INDEX_0, config_status},
    {VENDOR_TO_DEVICE, REQUEST_CONFIG_BEGIN, INDEX_0 | HEADER | JOB | DATA, config_begin},
    {VENDOR_TO_DEVICE, REQUEST_ABORT, VALUE_0 | INDEX_0 | NO_DATA, abort_job},
    {VENDOR_TO_DEVICE, REQUEST_CONFIG_BOOT, INDEX_0 | NO_DATA | JOB, config_boot},
    {VENDOR_FROM_DEVICE, REQUEST_STORE_STATUS, VALUE_0 | INDEX_0, get_store_status},
    {VENDOR_TO_DEVICE, REQUEST_STORE_READ, NO_DATA | JOB | DATA, begin_store_job},
    {VENDOR_TO_DEVICE, REQUEST_STORE_WRITE, INDEX_0 | HEADER | JOB | DATA, begin_store_job},
    {VENDOR_TO_DEVICE, REQUEST_STORE_ERASE, INDEX_0 | NO_DATA | JOB, begin_store_job},
    {VENDOR_TO_DEVICE, REQUEST_STORE_MARK, NO_DATA | JOB, begin_store_job},
    {VENDOR_FROM_DEVICE, REQUEST_EEPROM_READ, INDEX_0, answer_eeprom},
    {VENDOR_FROM_DEVICE, REQUEST_MICROSOFT, VALUE_0, microsoft_descriptor},
    {VENDOR_FROM_DEVICE, REQUEST_FPGA_REGISTER, VALUE_0, read_fpga_register},
    {VENDOR_TO_DEVICE, REQUEST_FPGA_REGISTER, NO_DATA, write_fpga_register},
    {VENDOR_FROM_DEVICE, REQUEST_CAMERA_REGISTER, VALUE_0, read_camera},
    {VENDOR_TO_DEVICE, REQUEST_CAMERA_REGISTER, NO_DATA, write_camera},
    {VENDOR_FROM_DEVICE, REQUEST_CAMERAS, VALUE_0 | INDEX_0, get_cameras_status},
    {VENDOR_TO_DEVICE, REQUEST_CAMERAS, VALUE_0 | INDEX_0 | NO_DATA, setup_cameras},
};
#define REQUEST_COUNT (sizeof requests / sizeof requests[0])

ONCE uint8_t endpoint_exists(void)
{
    uint8_t address = (uint8_t)usb_setup.index;

    if (usb_setup.index >> 8)
        return 0;
    if (address == USB_BULK_IN)
        return alternate; /* all but 0 */
    if (address == USB_BULK_OUT)
        return sink_exists();
    return !(address & 0x7Fu);
}

static uint8_t demands; /* of the request in hand */

/* Those of the demands that the request does not meet. */
ONCE uint8_t unmet(void)
{
    uint8_t left = demands;

    if (usb_setup.value == 0)
        left &= (uint8_t)~VALUE_0;
    if (usb_setup.index == 0)
        left &= (uint8_t)~INDEX_0;
    if (endpoint_exists())
        left &= (uint8_t)~ENDPOINT;
    if (usb_setup.length == 0)
        left &= (uint8_t)~NO_DATA;
    if (configuration != 0)
        left &= (uint8_t)~CONFIGURED;
    if (usb_setup.length == SLOT_HEADER_SIZE)
        left &= (uint8_t)~HEADER;
    if (!(alternate & 1u) && !job_is_busy())
        left &= (uint8_t)~JOB;
    if (alternate == USB_ALTERNATE_DATA)
        left &= (uint8_t)~DATA;
    return left;
}

/* What is to be called for the request whose data are on their way. */
static uint8_t (*IDATA waiting)(void);

/* The handler of the request in hand, NULL if there is none; `demands` are then its own. */
static uint8_t (*find_handler(void))(void)
{
    const CODE request_t *known = requests;

    do {
        if (known->type == usb_setup.type && known->number == usb_setup.number) {
            demands = known->demands;
            return known->handle;
        }
        known++;
    } while (known != requests + REQUEST_COUNT);
    return NULL;
}

static void handle(uint8_t (*handler)(void))
{
    if (!handler())
        usb_control_stall();
}

static void handle_setup(void)
{
    uint8_t (*handler)(void) = find_handler();

    waiting = NULL;
    if (handler == NULL || unmet()) {
        usb_control_stall();
    } else if (demands & HEADER) {
        waiting = handler;
        usb_control_receive();
    } else {
        handle(handler);
    }
}

/* A header comes with a vendor request. It is checked in flash_page, which other headers need too,
 * and kept for the store. */
ONCE void handle_data(void)
{
    uint8_t (*handler)(void) = waiting;
    uint8_t i = SLOT_HEADER_SIZE;

    waiting = NULL;
    do {
        i--;
        flash_page[i] = usb_control_data[i];
        slot_store_header[i] = usb_control_data[i];
    } while (i != 0);
    handle(handler);
}

uint8_t usb_device_poll(void)
{
    uint8_t events = usb_take_events();

    if (events & USB_EVENT_SUSPEND)
        abort_data_jobs();
    if (events & USB_EVENT_RESET)
        configure_device(0);
    if (events & USB_EVENT_SETUP) {
        usb_read_setup();
        handle_setup();
    }
    if (waiting != NULL && usb_control_received())
        handle_data();
    usb_control_continue();
    if (alternate != USB_ALTERNATE_SOURCE_SINK)
        return 0;
    return usb_bulk_serve();
}
