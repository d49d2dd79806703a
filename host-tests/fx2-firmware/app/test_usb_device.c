// sources: fx2-firmware/app/usb_device.c fx2-firmware/app/descriptors.c
// sources: fx2-firmware/app/descriptor_data.c
// sources: fx2-firmware/app/cameras.c
// sources: host-tests/fx2-firmware/fakes/fake_usb.c host-tests/fx2-firmware/fakes/fake_eyes.c
// sources: host-tests/fx2-firmware/fakes/fake_clock.c
// includes: fx2-firmware
#include "app/configure.h"
#include "app/descriptors.h"
#include "app/eeprom.h"
#include "app/flash_chip.h"
#include "app/slot_store.h"
#include "app/store.h"
#include "app/stream.h"
#include "app/usb_device.h"
#include "drivers/flash_bus.h"
#include "drivers/usb.h"
#include "host-tests/fx2-firmware/fakes/fake_eyes.h"
#include "host-tests/fx2-firmware/fakes/fake_usb.h"
#include "link/crc.h"

#include <string.h>
#include <unity.h>

/* The FPGA's status, which the device only passes on. */
static uint8_t fpga_status[CONFIG_STATUS_SIZE];
static uint8_t fpga_busy;

const uint8_t *configure_status(void)
{
    return fpga_status;
}

uint8_t configure_busy(void)
{
    return fpga_busy;
}

/* Jobs begun, and what with. */
static int jobs_begun;
static uint8_t job_argument;
static int aborted;
static int refuse_jobs;

void configure_from_flash(uint8_t slot)
{
    jobs_begun++;
    job_argument = slot;
}

static uint8_t begin_job(uint8_t argument)
{
    if (refuse_jobs)
        return 0;
    jobs_begun++;
    job_argument = argument;
    return 1;
}

uint8_t configure_from_usb(uint8_t kind)
{
    return begin_job(kind);
}

void configure_abort(void)
{
    aborted++;
}

static uint8_t store_is_busy;
static uint8_t store_wire[STORE_STATUS_SIZE] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};

uint8_t store_begin(void)
{
    return begin_job(usb_setup.number);
}

void store_abort(void) {}

uint8_t store_busy(void)
{
    return store_is_busy;
}

const uint8_t *store_status(void)
{
    return store_wire;
}

uint8_t flash_page[FLASH_PAGE];
uint8_t slot_store_header[SLOT_HEADER_SIZE];

uint16_t slot_store_crc(const uint8_t *data, uint8_t length)
{
    return crc16_ccitt(CRC16_INIT, data, length);
}

static int eeprom_answers;

uint8_t eeprom_read(uint16_t address, uint8_t length)
{
    for (uint8_t i = 0; i < length; i++)
        usb_control_data[i] = (uint8_t)(address + i);
    return (uint8_t)eeprom_answers;
}

/* Whether the way for streams is open. */
static int streaming;

void stream_open(void)
{
    streaming = 1;
}

void stream_close(void)
{
    streaming = 0;
}

static uint8_t flash_selected;

uint8_t flash_bus_is_selected(void)
{
    return flash_selected;
}

static void request(uint8_t type, uint8_t number, uint16_t value, uint16_t index, uint16_t length)
{
    fake_usb_setup(type, number, value, index, length);
    usb_device_poll();
}

static void set_configuration(uint16_t value)
{
    request(0x00, 9, value, 0, 0);
}

void setUp(void)
{
    fake_usb_high_speed = 1;
    store_is_busy = 0;
    fpga_busy = 0;
    refuse_jobs = 0;
    eeprom_answers = 1;
    descriptors_init();
    fake_usb_bus_reset();
    usb_device_poll();
    memset(fpga_status, 0, sizeof fpga_status);
    fpga_busy = 0;
    jobs_begun = 0;
    aborted = 0;
    fake_eyes_reset();
    flash_selected = 0;
    memset(&fake_usb_answer, 0, sizeof fake_usb_answer);
}

void tearDown(void) {}

static void set_interface(uint16_t alternate)
{
    request(0x01, 11, alternate, 0, 0);
}

static void assert_stalled(void)
{
    TEST_ASSERT_EQUAL(1, fake_usb_answers());
    TEST_ASSERT_EQUAL(1, fake_usb_answer.stalled);
}

static void assert_acknowledged(void)
{
    TEST_ASSERT_EQUAL(1, fake_usb_answers());
    TEST_ASSERT_EQUAL(1, fake_usb_answer.acknowledged);
}

static void assert_sent(const void *data, uint16_t length)
{
    TEST_ASSERT_EQUAL(1, fake_usb_answers());
    TEST_ASSERT_EQUAL(1, fake_usb_answer.sent);
    TEST_ASSERT_EQUAL(length, fake_usb_answer.length);
    TEST_ASSERT_EQUAL_MEMORY(data, fake_usb_answer.data, length);
}

static void assert_configuration(uint8_t value)
{
    request(0x80, 8, 0, 0, 1);
    assert_sent(&value, 1);
}

static void test_descriptors_are_cut_to_what_was_asked_for(void)
{
    const uint8_t *device = descriptor_find(USB_DESCRIPTOR_DEVICE, 0);

    for (uint16_t length = 1; length < 300; length++) {
        request(0x80, 6, 0x0100, 0, length);
        assert_sent(device, length < 18 ? length : 18);
        TEST_ASSERT_EQUAL(length > 18, fake_usb_answer.short_of_request);
    }
}

static void test_a_configuration_comes_with_all_that_belongs_to_it(void)
{
    const uint8_t *all = descriptor_find(USB_DESCRIPTOR_CONFIGURATION, 0);

    request(0x80, 6, 0x0200, 0, 9);
    assert_sent(all, 9);
    request(0x80, 6, 0x0200, 0, 0xFFFF);
    assert_sent(all, descriptor_length);
}

static void test_every_descriptor_can_be_read(void)
{
    static const uint16_t values[] = {0x0100, 0x0200, 0x0300, 0x0301,
                                      0x0302, 0x0600, 0x0700, 0x0F00};

    for (unsigned i = 0; i < sizeof values / sizeof values[0]; i++) {
        request(0x80, 6, values[i], 0x0409, 255);
        TEST_ASSERT_EQUAL(1, fake_usb_answer.sent);
        TEST_ASSERT_EQUAL(values[i] >> 8, fake_usb_answer.data[1]);
    }
}

static void test_an_unknown_descriptor_stalls(void)
{
    request(0x80, 6, 0x0101, 0, 18);
    assert_stalled();
    request(0x80, 6, 0x0303, 0x0409, 255);
    assert_stalled();
}

static void test_configuring_and_unconfiguring(void)
{
    assert_configuration(0);
    set_configuration(1);
    assert_acknowledged();
    assert_configuration(1);
    set_configuration(0);
    assert_acknowledged();
    assert_configuration(0);
}

static void test_a_bus_reset_unconfigures(void)
{
    set_configuration(1);
    fake_usb_bus_reset();
    usb_device_poll();
    assert_configuration(0);
}

static void test_a_reset_together_with_a_request_comes_first(void)
{
    set_configuration(1);
    fake_usb_bus_reset();
    assert_configuration(0);
}

static void test_an_unknown_configuration_stalls_and_changes_nothing(void)
{
    set_configuration(1);
    set_configuration(2);
    assert_stalled();
    set_configuration(0x0100);
    assert_stalled();
    request(0x00, 9, 0, 0, 1);
    assert_stalled();
    assert_configuration(1);
}

static void test_the_interface_exists_only_when_configured(void)
{
    request(0x81, 10, 0, 0, 1);
    assert_stalled();
    request(0x01, 11, 0, 0, 0);
    assert_stalled();
    request(0x81, 0, 0, 0, 2);
    assert_stalled();
    set_configuration(1);
    request(0x81, 10, 0, 0, 1);
    assert_sent("\0", 1);
    request(0x01, 11, 0, 0, 0);
    assert_acknowledged();
    request(0x81, 0, 0, 0, 2);
    assert_sent("\0\0", 2);
}

static void test_other_interfaces_and_settings_stall(void)
{
    set_configuration(1);
    set_interface(4);
    assert_stalled();
    set_interface(0x0101);
    assert_stalled();
    request(0x01, 11, 0, 1, 0);
    assert_stalled();
    request(0x81, 10, 0, 1, 1);
    assert_stalled();
}

static void test_the_device_is_self_powered(void)
{
    request(0x80, 0, 0, 0, 2);
    assert_sent("\1\0", 2);
}

static void test_endpoint_0_is_never_halted(void)
{
    request(0x82, 0, 0, 0x80, 2);
    assert_sent("\0\0", 2);
    request(0x02, 1, 0, 0x00, 0);
    assert_acknowledged();
    request(0x02, 3, 0, 0x00, 0);
    assert_stalled();
    request(0x82, 0, 0, 0x82, 2);
    assert_stalled();
    request(0x02, 1, 0, 0x02, 0);
    assert_stalled();
}

static void test_the_source_and_sink_open_with_their_setting(void)
{
    set_configuration(1);
    TEST_ASSERT_EQUAL(0, fake_usb_bulk_opened);
    set_interface(USB_ALTERNATE_SOURCE_SINK);
    assert_acknowledged();
    TEST_ASSERT_EQUAL(1, fake_usb_bulk_opened);
    TEST_ASSERT_TRUE(fake_usb_out_armed);
    request(0x81, 10, 0, 0, 1);
    assert_sent("\1", 1);
    set_interface(USB_ALTERNATE_CONTROL);
    assert_acknowledged();
    TEST_ASSERT_EQUAL(0, fake_usb_bulk_opened);
}

static void test_choosing_the_setting_again_starts_the_endpoints_anew(void)
{
    set_configuration(1);
    set_interface(USB_ALTERNATE_SOURCE_SINK);
    request(0x02, 3, 0, 0x86, 0);
    set_interface(USB_ALTERNATE_SOURCE_SINK);
    assert_acknowledged();
    TEST_ASSERT_EQUAL(2, fake_usb_bulk_opened);
    TEST_ASSERT_FALSE(fake_usb_bulk_halted_in);
}

static void test_a_reset_or_a_configuration_closes_the_endpoints(void)
{
    set_configuration(1);
    set_interface(USB_ALTERNATE_SOURCE_SINK);
    set_configuration(1);
    TEST_ASSERT_EQUAL(0, fake_usb_bulk_opened);
    request(0x81, 10, 0, 0, 1);
    assert_sent("\0", 1);
    set_interface(USB_ALTERNATE_SOURCE_SINK);
    fake_usb_bus_reset();
    usb_device_poll();
    TEST_ASSERT_EQUAL(0, fake_usb_bulk_opened);
}

static void test_the_endpoints_stay_closed_while_the_fpga_is_configured(void)
{
    set_configuration(1);
    fpga_busy = 1;
    set_interface(USB_ALTERNATE_SOURCE_SINK);
    assert_stalled();
    TEST_ASSERT_EQUAL(0, fake_usb_bulk_opened);
}

static void test_bulk_endpoints_halt_and_start_again(void)
{
    set_configuration(1);
    set_interface(USB_ALTERNATE_SOURCE_SINK);
    request(0x02, 3, 0, 0x02, 0);
    assert_acknowledged();
    request(0x82, 0, 0, 0x02, 2);
    assert_sent("\1\0", 2);
    request(0x82, 0, 0, 0x86, 2);
    assert_sent("\0\0", 2);
    request(0x02, 1, 0, 0x02, 0);
    assert_acknowledged();
    TEST_ASSERT_FALSE(fake_usb_bulk_halted_out);
}

static void test_endpoints_of_another_setting_or_address_stall(void)
{
    set_configuration(1);
    request(0x02, 3, 0, 0x86, 0);
    assert_stalled();
    set_interface(USB_ALTERNATE_SOURCE_SINK);
    request(0x82, 0, 0, 0x82, 2);
    assert_stalled();
    request(0x02, 1, 0, 0x06, 0);
    assert_stalled();
    request(0x02, 3, 1, 0x86, 0); /* a feature that endpoints do not have */
    assert_stalled();
    request(0x02, 3, 0, 0x0186, 0);
    assert_stalled();
}

static void test_the_fpgas_status_is_passed_on(void)
{
    uint8_t i;

    for (i = 0; i < CONFIG_STATUS_SIZE; i++)
        fpga_status[i] = (uint8_t)(i + 1);
    request(0xC0, REQUEST_CONFIG_STATUS, 0, 0, CONFIG_STATUS_SIZE);
    assert_sent(fpga_status, CONFIG_STATUS_SIZE);
    request(0xC0, REQUEST_CONFIG_STATUS, 0, 0, 5);
    assert_sent(fpga_status, 5);
    TEST_ASSERT_FALSE(fake_usb_answer.short_of_request);
    request(0xC0, REQUEST_CONFIG_STATUS, 0, 0, 4096);
    assert_sent(fpga_status, CONFIG_STATUS_SIZE);
    TEST_ASSERT_TRUE(fake_usb_answer.short_of_request);
}

static void test_an_ill_formed_status_request_stalls(void)
{
    request(0xC0, REQUEST_CONFIG_STATUS, 1, 0, CONFIG_STATUS_SIZE);
    assert_stalled();
    request(0xC0, REQUEST_CONFIG_STATUS, 0, 1, CONFIG_STATUS_SIZE);
    assert_stalled();
    request(0x40, REQUEST_CONFIG_STATUS, 0, 0, 0);
    assert_stalled();
}

static void test_a_request_for_no_bytes_is_acknowledged(void)
{
    request(0x80, 6, 0x0100, 0, 0);
    assert_acknowledged();
}

/* All pairs of bmRequestType and bRequest, with a few values each. */
static void test_any_request_gets_exactly_one_answer(void)
{
    static const uint16_t words[] = {0, 1, 2, 0x80, 0xFF, 0x0100, 0x0302, 0xFFFF};
    unsigned n = 0;

    for (unsigned type = 0; type < 256; type++) {
        for (unsigned number = 0; number < 256; number++) {
            request((uint8_t)type, (uint8_t)number, words[n % 8], words[n / 8 % 8],
                    words[n / 64 % 8]);
            n += 37;
            TEST_ASSERT_EQUAL(1, fake_usb_answers());
            if (fake_usb_answer.sent) {
                TEST_ASSERT_BITS_HIGH(0x80, type); /* never data into an OUT transfer */
            }
        }
    }
}

static void test_only_known_requests_are_not_stalled(void)
{
    int answered = 0;

    set_configuration(1);
    for (unsigned type = 0; type < 256; type++) {
        for (unsigned number = 0; number < 256; number++) {
            request((uint8_t)type, (uint8_t)number, number == 6 ? 0x0100 : 0, 0,
                    type & 0x80 ? 64 : 0);
            answered += !fake_usb_answer.stalled;
            set_configuration(1);
        }
    }
    TEST_ASSERT_EQUAL(22, answered);
}

static void test_nothing_is_answered_without_a_request(void)
{
    usb_device_poll();
    TEST_ASSERT_EQUAL(0, fake_usb_answers());
}

static void fpga_registers_are_read_and_written(void)
{
    static const uint8_t value[2] = {0x12, 0x34};

    request(0x40, REQUEST_FPGA_REGISTER, 0x1234, FPGA_REG_GOAL_ROW, 0);
    assert_acknowledged();
    TEST_ASSERT_EQUAL_HEX16(0x1234, fake_fpga_registers[FPGA_REG_GOAL_ROW]);
    request(0xC0, REQUEST_FPGA_REGISTER, 0, FPGA_REG_GOAL_ROW, 2);
    assert_sent(value, 2);
    request(0xC0, REQUEST_FPGA_REGISTER, 0, FPGA_REG_COUNT, 2);
    assert_stalled();
    request(0xC0, REQUEST_FPGA_REGISTER, 0, 0x100, 2);
    assert_stalled();
    request(0x40, REQUEST_FPGA_REGISTER, 0, FPGA_REG_COUNT, 0);
    assert_stalled();
}

static void fpga_registers_are_out_of_reach_while_the_flash_is_used(void)
{
    flash_selected = 1;
    request(0xC0, REQUEST_FPGA_REGISTER, 0, FPGA_REG_ID, 2);
    assert_stalled();
    request(0x40, REQUEST_FPGA_REGISTER, 1, FPGA_REG_GOAL_ROW, 0);
    assert_stalled();
    request(0x40, REQUEST_CAMERAS, 0, 0, 0);
    assert_stalled();
    TEST_ASSERT_EQUAL_INT(0, fake_i2c_transfers);
}

static void the_fpga_may_stream_only_where_it_is_let(void)
{
    set_configuration(1);
    request(0x40, REQUEST_FPGA_REGISTER, FPGA_STREAM_ON, FPGA_REG_STREAM, 0);
    assert_stalled();
    TEST_ASSERT_EQUAL_HEX16(0, fake_fpga_registers[FPGA_REG_STREAM]);
}

static void camera_registers_are_read_and_written(void)
{
    static const uint8_t pid = 0x76;

    request(0xC0, REQUEST_CAMERA_REGISTER, 0, 0x010A, 1);
    assert_sent(&pid, 1);
    request(0x40, REQUEST_CAMERA_REGISTER, 0x55, 0x0100, 0);
    assert_acknowledged();
    TEST_ASSERT_EQUAL_HEX8(0x55, fake_cameras[1].registers[0]);
    request(0x40, REQUEST_CAMERA_REGISTER, 0x100, 0x0100, 0);
    assert_stalled();
    request(0x40, REQUEST_CAMERA_REGISTER, 0, 0x0200, 0);
    assert_stalled();
    fake_cameras[1].present = 0;
    request(0xC0, REQUEST_CAMERA_REGISTER, 0, 0x010A, 1);
    assert_stalled();
}

static void both_cameras_are_set_up_and_their_status_is_told(void)
{
    static const uint8_t status[CAMERAS_STATUS_SIZE] = {1, 0, 1, 0};

    fake_cameras[1].present = 0;
    request(0x40, REQUEST_CAMERAS, 0, 0, 0);
    assert_acknowledged();
    request(0xC0, REQUEST_CAMERAS, 0, 0, CAMERAS_STATUS_SIZE);
    assert_sent(status, CAMERAS_STATUS_SIZE);
}

/* ---- jobs ---- */

static const uint8_t header[SLOT_HEADER_SIZE] = {'S', 'L', 'O', 'T', 1, 2, 3};

static void request_with_header(uint8_t number, uint16_t value, uint16_t index)
{
    request(0x40, number, value, index, SLOT_HEADER_SIZE);
    if (fake_usb_answers() == 0) {
        fake_usb_data(header, SLOT_HEADER_SIZE);
        usb_device_poll();
    }
}

static void choose_data(void)
{
    set_configuration(1);
    set_interface(USB_ALTERNATE_DATA);
    assert_acknowledged();
    TEST_ASSERT_FALSE(fake_usb_out_armed);
}

static void test_a_header_is_waited_for_and_passed_on(void)
{
    choose_data();
    request(0x40, REQUEST_CONFIG_BEGIN, 1, 0, SLOT_HEADER_SIZE);
    TEST_ASSERT_EQUAL(0, fake_usb_answers());
    usb_device_poll();
    TEST_ASSERT_EQUAL(0, fake_usb_answers());
    fake_usb_data(header, SLOT_HEADER_SIZE);
    usb_device_poll();
    assert_acknowledged();
    TEST_ASSERT_EQUAL(1, jobs_begun);
    TEST_ASSERT_EQUAL(CONFIG_BEGIN_PARTIAL, job_argument);
    TEST_ASSERT_EQUAL_MEMORY(header, flash_page, SLOT_HEADER_SIZE);
    request_with_header(REQUEST_STORE_WRITE, 3, 0);
    assert_acknowledged();
    TEST_ASSERT_EQUAL(REQUEST_STORE_WRITE, job_argument);
    TEST_ASSERT_EQUAL_MEMORY(header, slot_store_header, SLOT_HEADER_SIZE);
}

static void test_a_new_request_cancels_one_that_waits_for_its_data(void)
{
    choose_data();
    request(0x40, REQUEST_CONFIG_BEGIN, 0, 0, SLOT_HEADER_SIZE);
    assert_configuration(1);
    usb_device_poll();
    TEST_ASSERT_EQUAL(0, jobs_begun);
}

static void test_a_job_that_is_refused_stalls(void)
{
    choose_data();
    refuse_jobs = 1;
    request_with_header(REQUEST_CONFIG_BEGIN, 0, 0);
    assert_stalled();
    request_with_header(REQUEST_STORE_WRITE, 0, 0);
    assert_stalled();
    request(0x40, REQUEST_STORE_READ, 0, 1, 0);
    assert_stalled();
}

static void test_jobs_without_data_are_begun_in_settings_0_and_2(void)
{
    static const uint8_t numbers[] = {REQUEST_CONFIG_BOOT, REQUEST_STORE_ERASE, REQUEST_STORE_MARK};

    for (uint16_t setting = 0; setting <= USB_ALTERNATE_STREAM; setting++) {
        for (unsigned i = 0; i < sizeof numbers; i++) {
            set_configuration(1);
            set_interface(setting);
            jobs_begun = 0;
            request(0x40, numbers[i], 7, numbers[i] == REQUEST_STORE_MARK ? 'D' : 0, 0);
            TEST_ASSERT_EQUAL(!(setting & 1), fake_usb_answer.acknowledged);
            TEST_ASSERT_EQUAL(!(setting & 1), jobs_begun);
        }
    }
}

static void test_jobs_with_data_are_begun_in_setting_2_only(void)
{
    for (uint16_t setting = 0; setting <= USB_ALTERNATE_STREAM; setting++) {
        set_configuration(1);
        set_interface(setting);
        jobs_begun = 0;
        request_with_header(REQUEST_CONFIG_BEGIN, 0, 0);
        request_with_header(REQUEST_STORE_WRITE, 0, 0);
        request(0x40, REQUEST_STORE_READ, 0, 1, 0);
        TEST_ASSERT_EQUAL(setting == USB_ALTERNATE_DATA ? 3 : 0, jobs_begun);
    }
}

static void test_one_job_at_a_time(void)
{
    choose_data();
    for (int which = 0; which < 2; which++) {
        fpga_busy = which == 0;
        store_is_busy = which == 1;
        request_with_header(REQUEST_CONFIG_BEGIN, 0, 0);
        assert_stalled();
        request_with_header(REQUEST_STORE_WRITE, 0, 0);
        assert_stalled();
        request(0x40, REQUEST_CONFIG_BOOT, 0, 0, 0);
        assert_stalled();
        request(0x40, REQUEST_STORE_ERASE, 0, 0, 0);
        assert_stalled();
        set_interface(USB_ALTERNATE_SOURCE_SINK);
        assert_stalled();
        set_interface(USB_ALTERNATE_STREAM);
        assert_stalled();
    }
    TEST_ASSERT_EQUAL(0, jobs_begun);
}

static void test_slots_and_kinds_that_do_not_exist_stall(void)
{
    choose_data();
    request(0x40, REQUEST_CONFIG_BOOT, 32, 0, 0);
    assert_stalled();
    request(0x40, REQUEST_CONFIG_BOOT, 0x0103, 0, 0);
    assert_stalled();
    request_with_header(REQUEST_CONFIG_BEGIN, 2, 0);
    assert_stalled();
    request(0x40, REQUEST_CONFIG_BOOT, CONFIG_BOOT_DEFAULT, 0, 0);
    assert_acknowledged();
    TEST_ASSERT_EQUAL(CONFIG_BOOT_DEFAULT, job_argument);
}

static void test_what_ends_jobs(void)
{
    choose_data();
    aborted = 0;
    request(0x40, REQUEST_ABORT, 0, 0, 0);
    assert_acknowledged();
    TEST_ASSERT_EQUAL(1, aborted);
    fake_usb_suspend();
    usb_device_poll();
    TEST_ASSERT_EQUAL(2, aborted);
    set_interface(USB_ALTERNATE_DATA);
    TEST_ASSERT_EQUAL(3, aborted);
    set_configuration(1);
    TEST_ASSERT_EQUAL(4, aborted);
    fake_usb_bus_reset();
    usb_device_poll();
    TEST_ASSERT_EQUAL(5, aborted);
}

static void test_a_suspended_bus_changes_nothing_else(void)
{
    choose_data();
    fake_usb_suspend();
    usb_device_poll();
    assert_configuration(1);
    request(0x81, 10, 0, 0, 1);
    assert_sent("\2", 1);
}

static void test_the_stores_status_is_passed_on(void)
{
    request(0xC0, REQUEST_STORE_STATUS, 0, 0, 64);
    assert_sent(store_wire, STORE_STATUS_SIZE);
}

static void test_the_eeprom_is_read(void)
{
    static const uint8_t expected[4] = {0x34, 0x35, 0x36, 0x37};

    request(0xC0, REQUEST_EEPROM_READ, 0x1234, 0, 4);
    assert_sent(expected, 4);
    request(0xC0, REQUEST_EEPROM_READ, 0, 0, EEPROM_READ_MAX);
    TEST_ASSERT_EQUAL(1, fake_usb_answer.sent);
    request(0xC0, REQUEST_EEPROM_READ, 0, 0, EEPROM_READ_MAX + 1);
    assert_stalled();
    request(0xC0, REQUEST_EEPROM_READ, 0, 0, 0);
    assert_stalled();
    eeprom_answers = 0;
    request(0xC0, REQUEST_EEPROM_READ, 0, 0, 4);
    assert_stalled();
}

static void test_windows_gets_its_descriptor_set(void)
{
    request(0xC0, REQUEST_MICROSOFT, 0, 7, 1000);
    TEST_ASSERT_EQUAL(162, fake_usb_answer.length);
    TEST_ASSERT_EQUAL(10, fake_usb_answer.data[0]);
    request(0xC0, REQUEST_MICROSOFT, 0, 6, 1000);
    assert_stalled();
}

static void test_endpoints_exist_as_their_setting_says(void)
{
    static const uint8_t exists[4][2] = {{0, 0}, {1, 1}, {1, 1}, {0, 1}};

    set_configuration(1);
    for (uint8_t setting = 0; setting < 4; setting++) {
        set_interface(setting);
        request(0x82, 0, 0, USB_BULK_OUT, 2);
        TEST_ASSERT_EQUAL(exists[setting][0], fake_usb_answer.sent);
        fake_usb_bulk_opened += setting == USB_ALTERNATE_STREAM;
        request(0x82, 0, 0, USB_BULK_IN, 2);
        TEST_ASSERT_EQUAL(exists[setting][1], fake_usb_answer.sent);
        request(0x82, 0, 0, 0x81, 2);
        assert_stalled();
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_descriptors_are_cut_to_what_was_asked_for);
    RUN_TEST(test_a_configuration_comes_with_all_that_belongs_to_it);
    RUN_TEST(test_every_descriptor_can_be_read);
    RUN_TEST(test_an_unknown_descriptor_stalls);
    RUN_TEST(test_configuring_and_unconfiguring);
    RUN_TEST(test_a_bus_reset_unconfigures);
    RUN_TEST(test_a_reset_together_with_a_request_comes_first);
    RUN_TEST(test_an_unknown_configuration_stalls_and_changes_nothing);
    RUN_TEST(test_the_interface_exists_only_when_configured);
    RUN_TEST(test_other_interfaces_and_settings_stall);
    RUN_TEST(test_the_device_is_self_powered);
    RUN_TEST(test_endpoint_0_is_never_halted);
    RUN_TEST(test_the_source_and_sink_open_with_their_setting);
    RUN_TEST(test_choosing_the_setting_again_starts_the_endpoints_anew);
    RUN_TEST(test_a_reset_or_a_configuration_closes_the_endpoints);
    RUN_TEST(test_the_endpoints_stay_closed_while_the_fpga_is_configured);
    RUN_TEST(test_bulk_endpoints_halt_and_start_again);
    RUN_TEST(test_endpoints_of_another_setting_or_address_stall);
    RUN_TEST(test_the_fpgas_status_is_passed_on);
    RUN_TEST(test_an_ill_formed_status_request_stalls);
    RUN_TEST(test_a_request_for_no_bytes_is_acknowledged);
    RUN_TEST(test_any_request_gets_exactly_one_answer);
    RUN_TEST(test_only_known_requests_are_not_stalled);
    RUN_TEST(test_nothing_is_answered_without_a_request);
    RUN_TEST(fpga_registers_are_read_and_written);
    RUN_TEST(fpga_registers_are_out_of_reach_while_the_flash_is_used);
    RUN_TEST(the_fpga_may_stream_only_where_it_is_let);
    RUN_TEST(camera_registers_are_read_and_written);
    RUN_TEST(both_cameras_are_set_up_and_their_status_is_told);
    RUN_TEST(test_a_header_is_waited_for_and_passed_on);
    RUN_TEST(test_a_new_request_cancels_one_that_waits_for_its_data);
    RUN_TEST(test_a_job_that_is_refused_stalls);
    RUN_TEST(test_jobs_without_data_are_begun_in_settings_0_and_2);
    RUN_TEST(test_jobs_with_data_are_begun_in_setting_2_only);
    RUN_TEST(test_one_job_at_a_time);
    RUN_TEST(test_slots_and_kinds_that_do_not_exist_stall);
    RUN_TEST(test_what_ends_jobs);
    RUN_TEST(test_a_suspended_bus_changes_nothing_else);
    RUN_TEST(test_the_stores_status_is_passed_on);
    RUN_TEST(test_the_eeprom_is_read);
    RUN_TEST(test_windows_gets_its_descriptor_set);
    RUN_TEST(test_endpoints_exist_as_their_setting_says);
    return UNITY_END();
}
