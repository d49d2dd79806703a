/* What PC and FX2 know of the cameras: OV7670 class, RGB565 parallel, registers over I2C.
 *
 * Register numbers and bits are those of the OV7670's data sheet (version 1.4). docs/SPEC.md
 * section 8 says how each setting is made of them. */
#ifndef LINK_CAMERA_H
#define LINK_CAMERA_H

#define CAMERA_REG_GAIN   0x00u /* bits 4..7 double the gain each, bits 0..3 add sixteenths */
#define CAMERA_REG_BLUE   0x01u /* white balance: 80 = 1.0 */
#define CAMERA_REG_RED    0x02u /* the same */
#define CAMERA_REG_COM1   0x04u /* bits 0..1: exposure, bits 0..1 */
#define CAMERA_REG_AECHH  0x07u /* bits 0..5: exposure, bits 10..15 */
#define CAMERA_REG_PID    0x0Au /* CAMERA_PID */
#define CAMERA_REG_VER    0x0Bu /* CAMERA_VER */
#define CAMERA_REG_AECH   0x10u /* exposure, bits 2..9, in rows */
#define CAMERA_REG_COM7   0x12u /* format */
#define CAMERA_REG_COM8   0x13u /* what the camera controls by itself */
#define CAMERA_REG_AEW    0x24u /* automatic exposure: a mean above that is too bright */
#define CAMERA_REG_AEB    0x25u /* below that too dark */
#define CAMERA_REG_VPT    0x26u /* bits 4..7, 0..3: beyond these, sixteenths, it takes big steps */
#define CAMERA_REG_COM15  0x40u /* coding of the pixels */
#define CAMERA_REG_TEST_X 0x70u /* bit 7: bit 0 of the test pattern's number */
#define CAMERA_REG_TEST_Y 0x71u /* bit 7: its bit 1 */
#define CAMERA_REG_LAST   0xC9u

#define CAMERA_PID 0x76u
#define CAMERA_VER 0x73u

#define CAMERA_COM7_RESET         0x80u
#define CAMERA_COM7_SIZE          0x38u
#define CAMERA_COM7_SIZE_640X480  0x00u
#define CAMERA_COM7_SIZE_320X240  0x10u
#define CAMERA_COM7_CODING        0x05u
#define CAMERA_COM7_CODING_RGB    0x04u
#define CAMERA_COM8_AUTO_GAIN     0x04u
#define CAMERA_COM8_AUTO_WHITE    0x02u
#define CAMERA_COM8_AUTO_EXPOSURE 0x01u
#define CAMERA_COM15_RGB          0x30u
#define CAMERA_COM15_RGB565       0x10u
#define CAMERA_TEST_BIT           0x80u

/* Number of the test pattern, from the two CAMERA_TEST_BITs. */
#define CAMERA_PATTERN_NONE 0u
#define CAMERA_PATTERN_ONES 1u /* a single one that wanders through the bits */
#define CAMERA_PATTERN_BARS                                                                        \
    2u /* eight bars: white, yellow, cyan, green, magenta, red, blue, black */
#define CAMERA_PATTERN_FADE 3u /* the bars, fading to grey downwards */

/* How a camera is: the outcome of its set-up, or of the last access to it. */
#define CAMERA_OK        0u
#define CAMERA_NO_ACK    1u    /* does not answer at its address */
#define CAMERA_BUS_STUCK 2u    /* the I2C clock line is held low */
#define CAMERA_WRONG_ID  3u    /* answers, but is another chip */
#define CAMERA_NO_MUX    4u    /* the multiplexer does not answer */
#define CAMERA_NO_FPGA   5u    /* no design runs in the FPGA: cameras have no clock and no table */
#define CAMERA_UNKNOWN   0xFFu /* never set up */

#endif
