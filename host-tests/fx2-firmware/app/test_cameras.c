// sources: fx2-firmware/app/cameras.c
// sources: host-tests/fx2-firmware/fakes/fake_eyes.c host-tests/fx2-firmware/fakes/fake_clock.c
// includes: fx2-firmware
/* Finding the cameras and setting them up, and what is said when one of them fails. */
#include "app/cameras.h"
#include "drivers/i2c.h"
#include "host-tests/fx2-firmware/fakes/fake_clock.h"
#include "host-tests/fx2-firmware/fakes/fake_eyes.h"
#include "link/camera.h"

#include <unity.h>

void setUp(void)
{
    fake_eyes_reset();
}

void tearDown(void) {}

static void assert_status(uint8_t left, uint8_t right)
{
    TEST_ASSERT_EQUAL_HEX8(left, cameras_status[0]);
    TEST_ASSERT_EQUAL_HEX8(right, cameras_status[1]);
}

static void both_are_reset_and_get_the_table(void)
{
    int eye;

    cameras_setup();
    assert_status(CAMERA_OK, CAMERA_OK);
    for (eye = 0; eye < 2; eye++) {
        TEST_ASSERT_EQUAL_INT(1, fake_cameras[eye].resets);
        TEST_ASSERT_EQUAL_INT(2, fake_cameras[eye].writes);
        TEST_ASSERT_EQUAL_HEX8(0x14, fake_cameras[eye].registers[CAMERA_REG_COM7]);
        TEST_ASSERT_EQUAL_HEX8(0xD0, fake_cameras[eye].registers[CAMERA_REG_COM15]);
    }
}

static void the_other_format_has_its_own_table(void)
{
    fake_fpga_registers[FPGA_REG_FORMAT] = FPGA_FORMAT_640X480;
    cameras_setup();
    TEST_ASSERT_EQUAL_HEX8(0x04, fake_cameras[0].registers[CAMERA_REG_COM7]);
    TEST_ASSERT_EQUAL_HEX8(0x04, fake_cameras[1].registers[CAMERA_REG_COM7]);
}

static void a_full_table_ends_with_its_place(void)
{
    int i;

    for (i = 0; i < (int)FPGA_CAMERA_TABLE_ENTRIES; i++)
        fake_fpga_registers[FPGA_REG_CAMERA_TABLE + (unsigned)i] = (uint16_t)(0x2000 + 0x0101 * i);
    cameras_setup();
    TEST_ASSERT_EQUAL_INT(FPGA_CAMERA_TABLE_ENTRIES, fake_cameras[1].writes);
}

static void a_missing_camera_leaves_the_other_alone(void)
{
    fake_cameras[0].present = 0;
    cameras_setup();
    assert_status(CAMERA_NO_ACK, CAMERA_OK);
    TEST_ASSERT_EQUAL_INT(2, fake_cameras[1].writes);
}

static void a_camera_of_another_kind_is_not_written_to(void)
{
    fake_cameras[1].registers[CAMERA_REG_VER] = 0x70;
    cameras_setup();
    assert_status(CAMERA_OK, CAMERA_WRONG_ID);
    TEST_ASSERT_EQUAL_INT(0, fake_cameras[1].resets + fake_cameras[1].writes);
    fake_cameras[1].registers[CAMERA_REG_VER] = CAMERA_VER;
    fake_cameras[1].registers[CAMERA_REG_PID] = 0x77;
    cameras_setup();
    assert_status(CAMERA_OK, CAMERA_WRONG_ID);
}

static void a_held_clock_a_missing_multiplexer_and_a_missing_design_have_names(void)
{
    fake_i2c_stuck = 1;
    cameras_setup();
    assert_status(CAMERA_BUS_STUCK, CAMERA_BUS_STUCK);
    fake_i2c_stuck = 0;
    fake_mux_present = 0;
    cameras_setup();
    assert_status(CAMERA_NO_MUX, CAMERA_NO_MUX);
    fake_i2c_transfers = 0;
    fake_fpga_registers[FPGA_REG_ID] = 0;
    cameras_setup();
    assert_status(CAMERA_NO_FPGA, CAMERA_NO_FPGA);
    TEST_ASSERT_EQUAL_INT(0, fake_i2c_transfers);
}

static void a_failed_camera_is_tried_again_after_a_second_and_only_that_one(void)
{
    fake_cameras[0].present = 0;
    cameras_setup();
    fake_cameras[0].present = 1;
    cameras_step();
    assert_status(CAMERA_NO_ACK, CAMERA_OK);
    fake_clock_now_us += 1100000ul;
    cameras_step();
    assert_status(CAMERA_OK, CAMERA_OK);
    TEST_ASSERT_EQUAL_INT(1, fake_cameras[1].resets);
    fake_i2c_transfers = 0;
    fake_clock_now_us += 1100000ul;
    cameras_step();
    TEST_ASSERT_EQUAL_INT(0, fake_i2c_transfers);
}

static void single_registers_are_read_and_written(void)
{
    cameras_setup();
    TEST_ASSERT_EQUAL_UINT8(CAMERA_OK, camera_write(1, CAMERA_REG_GAIN, 0x33));
    TEST_ASSERT_EQUAL_HEX8(0x33, fake_cameras[1].registers[CAMERA_REG_GAIN]);
    TEST_ASSERT_EQUAL_HEX8(0, fake_cameras[0].registers[CAMERA_REG_GAIN]);
    TEST_ASSERT_EQUAL_UINT8(CAMERA_OK, camera_read(1, CAMERA_REG_GAIN));
    TEST_ASSERT_EQUAL_HEX8(0x33, i2c_bytes[0]);
}

static void a_failed_access_shows_in_the_status_of_that_eye(void)
{
    cameras_setup();
    fake_cameras[1].present = 0;
    TEST_ASSERT_EQUAL_UINT8(CAMERA_NO_ACK, camera_read(1, CAMERA_REG_GAIN));
    assert_status(CAMERA_OK, CAMERA_NO_ACK);
    TEST_ASSERT_EQUAL_UINT8(CAMERA_OK, camera_read(0, CAMERA_REG_GAIN));
    fake_i2c_stuck = 1;
    TEST_ASSERT_EQUAL_UINT8(CAMERA_BUS_STUCK, camera_write(0, CAMERA_REG_GAIN, 1));
    assert_status(CAMERA_BUS_STUCK, CAMERA_NO_ACK);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(both_are_reset_and_get_the_table);
    RUN_TEST(the_other_format_has_its_own_table);
    RUN_TEST(a_full_table_ends_with_its_place);
    RUN_TEST(a_missing_camera_leaves_the_other_alone);
    RUN_TEST(a_camera_of_another_kind_is_not_written_to);
    RUN_TEST(a_held_clock_a_missing_multiplexer_and_a_missing_design_have_names);
    RUN_TEST(a_failed_camera_is_tried_again_after_a_second_and_only_that_one);
    RUN_TEST(single_registers_are_read_and_written);
    RUN_TEST(a_failed_access_shows_in_the_status_of_that_eye);
    return UNITY_END();
}
