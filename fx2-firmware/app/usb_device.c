#include "app/usb_device.h"

#include "app/configure.h"
#include "app/descriptors.h"
#include "drivers/usb.h"
#include "link/requests.h"

#include <stddef.h>

/* bmRequestType: direction, kind and recipient in one. */
enum {
    TO_DEVICE = 0x00,
    TO_INTERFACE = 0x01,
    TO_ENDPOINT = 0x02,
    FROM_DEVICE = 0x80,
    FROM_INTERFACE = 0x81,
    FROM_ENDPOINT = 0x82,
    VENDOR_FROM_DEVICE = 0xC0
};

/* bRequest of the standard requests. SET_ADDRESS the hardware answers. */
enum {
    GET_STATUS = 0,
    CLEAR_FEATURE = 1,
    GET_DESCRIPTOR = 6,
    GET_CONFIGURATION = 8,
    SET_CONFIGURATION = 9,
    GET_INTERFACE = 10,
    SET_INTERFACE = 11
};

enum { FEATURE_ENDPOINT_HALT = 0, STATUS_SELF_POWERED = 1 };

static uint8_t configuration; /* 0 = not configured */
static XDATA uint8_t reply[CONFIG_STATUS_SIZE];

/* The handlers below answer and return 1, or return 0 for a request to be refused. */

static uint8_t answer(const XDATA uint8_t *data, uint16_t length)
{
    if (usb_setup.length == 0)
        usb_control_acknowledge();
    else if (length < usb_setup.length)
        usb_control_send(data, length, 1);
    else
        usb_control_send(data, usb_setup.length, 0);
    return 1;
}

static uint8_t answer_byte(uint8_t value)
{
    reply[0] = value;
    return answer(reply, 1);
}

/* The end of a request that carries no data. */
static uint8_t acknowledge(void)
{
    if (usb_setup.length != 0)
        return 0;
    usb_control_acknowledge();
    return 1;
}

/* Interface 0 is there once the device is configured. */
static uint8_t interface_exists(void)
{
    return configuration != 0 && usb_setup.index == 0;
}

/* Endpoint 0, in either direction, is the only one. */
static uint8_t endpoint_exists(void)
{
    return (usb_setup.index & 0xFF7Fu) == 0;
}

static uint8_t get_descriptor(void)
{
    const XDATA uint8_t *data =
        descriptor_find((uint8_t)(usb_setup.value >> 8), (uint8_t)usb_setup.value);

    return data != NULL && answer(data, descriptor_length(data));
}

static uint8_t answer_status(uint8_t status)
{
    if (usb_setup.value != 0)
        return 0;
    reply[0] = status;
    reply[1] = 0;
    return answer(reply, 2);
}

static uint8_t get_device_status(void)
{
    return usb_setup.index == 0 && answer_status(STATUS_SELF_POWERED);
}

static uint8_t get_interface_status(void)
{
    return interface_exists() && answer_status(0);
}

static uint8_t get_endpoint_status(void)
{
    return endpoint_exists() && answer_status(0);
}

/* Endpoint 0 never halts, so there is nothing to clear; to halt it would be of no use. */
static uint8_t clear_endpoint_feature(void)
{
    return usb_setup.value == FEATURE_ENDPOINT_HALT && endpoint_exists() && acknowledge();
}

static uint8_t get_configuration(void)
{
    return usb_setup.value == 0 && usb_setup.index == 0 && answer_byte(configuration);
}

static uint8_t set_configuration(void)
{
    if (usb_setup.value > USB_CONFIGURATION_VALUE || usb_setup.index != 0)
        return 0;
    if (!acknowledge())
        return 0;
    configuration = (uint8_t)usb_setup.value;
    return 1;
}

/* Interface 0 has but its alternate setting 0. */
static uint8_t get_interface(void)
{
    return interface_exists() && usb_setup.value == 0 && answer_byte(0);
}

static uint8_t set_interface(void)
{
    return interface_exists() && usb_setup.value == 0 && acknowledge();
}

static uint8_t config_status(void)
{
    if (usb_setup.value != 0 || usb_setup.index != 0 || usb_setup.length < CONFIG_STATUS_SIZE)
        return 0;
    config_status_encode(configure_status(), reply);
    return answer(reply, CONFIG_STATUS_SIZE);
}

/* Every request we know. Those without a data stage end in acknowledge(). */
static const CODE struct {
    uint8_t type;
    uint8_t number;
    uint8_t (*handle)(void);
} requests[] = {
    {FROM_DEVICE, GET_DESCRIPTOR, get_descriptor},
    {FROM_DEVICE, GET_CONFIGURATION, get_configuration},
    {FROM_DEVICE, GET_STATUS, get_device_status},
    {FROM_INTERFACE, GET_STATUS, get_interface_status},
    {FROM_INTERFACE, GET_INTERFACE, get_interface},
    {FROM_ENDPOINT, GET_STATUS, get_endpoint_status},
    {TO_DEVICE, SET_CONFIGURATION, set_configuration},
    {TO_INTERFACE, SET_INTERFACE, set_interface},
    {TO_ENDPOINT, CLEAR_FEATURE, clear_endpoint_feature},
    {VENDOR_FROM_DEVICE, REQUEST_CONFIG_STATUS, config_status},
};
#define REQUEST_COUNT (sizeof requests / sizeof requests[0])

static uint8_t handle_request(void)
{
    uint8_t i;

    for (i = 0; i < REQUEST_COUNT; i++) {
        if (requests[i].type == usb_setup.type && requests[i].number == usb_setup.number)
            return requests[i].handle();
    }
    return 0;
}

void usb_device_poll(void)
{
    uint8_t events = usb_take_events();

    if (events & USB_EVENT_RESET)
        configuration = 0;
    if (events & USB_EVENT_SETUP) {
        usb_read_setup();
        if (!handle_request())
            usb_control_stall();
    }
    usb_control_continue();
}
