/* USB: what the turret's FX2 answers. docs/SPEC.md section 4 owns grammar and golden bytes.
 *
 * Vendor requests go to the device (bmRequestType 0x40 out, 0xC0 in). Every request has exactly one
 * reply; an unknown or ill-formed one STALLs and changes nothing. What takes longer than a request
 * may is a job: the request starts it, its status says how it goes. One job at a time: while one
 * is busy, whatever would start another STALLs.
 *
 * Numbers: A0 the chip's own (RAM load), B0..B7 configuration, B8..BF bitstream store, C0..C7
 * streaming, cameras and FPGA registers, D0..D7 the board, E0..E7 the EEPROM loader
 * (link/eeprom.h), which is another program. */
#ifndef LINK_REQUESTS_H
#define LINK_REQUESTS_H

#include <stdint.h>

/* The pair is a test assignment (pid.codes range for private use): an assumption until one of our
 * own is registered. */
#define USB_VENDOR_ID      0x1209u
#define USB_PRODUCT_ID     0x0001u
/* bcdDevice: API level in the high byte (the host checks it), board revision in the low. */
#define USB_API_LEVEL      0x01u
#define USB_BOARD_REVISION 0x01u

/* Interface 0's alternate settings. Jobs need one of those that say so. */
#define USB_ALTERNATE_CONTROL     0u /* control transfers only */
#define USB_ALTERNATE_SOURCE_SINK 1u /* 02 throws away what comes, 86 gives zeros; no jobs */
#define USB_ALTERNATE_DATA        2u /* 02 and 86 carry the data of jobs */
#define USB_ALTERNATE_STREAM      3u /* 86 streams from the FPGA; no jobs */
#define USB_BULK_OUT              0x02u
#define USB_BULK_IN               0x86u

/* ---- Configuration ---- */

/* IN, wValue = wIndex = 0: how the FPGA's configuration stands. */
#define REQUEST_CONFIG_STATUS 0xB0u
#define CONFIG_STATUS_SIZE    16u
#define CONFIG_STATUS_VERSION 1u

/* OUT, alternate setting 2, wIndex = 0, data = the bitstream's slot header (link/slots.h, 64
 * bytes), of which `length` and `part` count here; then exactly `length` bytes to endpoint 02.
 * STALLs if the header is damaged or names another part than the board's, and for a partial
 * bitstream while the FPGA runs no design. */
#define REQUEST_CONFIG_BEGIN 0xB1u
#define CONFIG_BEGIN_FULL    0u /* wValue: erase the FPGA first */
#define CONFIG_BEGIN_PARTIAL 1u /* wValue: the design goes on running */
/* OUT, wValue = wIndex = 0, no data: end a job that moves data over USB. There being none is no
 * error; others take their course. */
#define REQUEST_ABORT        0xB2u
/* OUT, alternate setting 0 or 2, wValue = slot 0..31 or CONFIG_BOOT_DEFAULT, wIndex = 0, no data:
 * configure the FPGA from the flash. */
#define REQUEST_CONFIG_BOOT  0xB3u
#define CONFIG_BOOT_DEFAULT  0xFFu /* as at power-on: the default slot */

/* If a configuration fails, the golden slot is loaded in its place; if that fails too or there is
 * none, the FPGA is left erased. */

/* config_status_t.result and .cause */
#define CONFIG_OK         0u /* DONE is high */
#define CONFIG_BUSY       1u /* still going on */
#define CONFIG_NO_FLASH   2u /* the flash does not answer its CFI query, or is the wrong one */
#define CONFIG_NO_DEFAULT 3u /* no slot is marked default */
#define CONFIG_BAD_SLOT   4u /* the slot holds no whole bitstream for the board's part */
#define CONFIG_NO_INIT    5u /* INIT# did not rise after PROG#: no FPGA, or no supply */
#define CONFIG_CRC_ERROR  6u /* INIT# fell: the FPGA's CRC found the bitstream damaged */
#define CONFIG_NO_DONE    7u /* all bytes are in but DONE stays low: not a whole bitstream */
#define CONFIG_BUS_STUCK  8u /* a block did not get from flash to FPGA in its time */
#define CONFIG_ABORTED                                                                             \
    9u                          /* REQUEST_ABORT, bus reset, suspend (cable pulled), or another    \
                                   alternate setting */
#define CONFIG_NO_DATA    10u   /* the host sent nothing for CONFIG_DATA_TIMEOUT_MS */
#define CONFIG_TOO_LONG   11u   /* the host sent more than it had announced */
#define CONFIG_WRONG_PART 12u   /* the slot's bitstream is for another part */
#define CONFIG_NO_SLOT    0xFFu /* config_status_t.slot: none */

#define CONFIG_DATA_TIMEOUT_MS 2000u

/* config_status_t.source: where the bytes come or came from */
#define CONFIG_FROM_DEFAULT 0u /* the default slot: at power-on, or CONFIG_BOOT_DEFAULT */
#define CONFIG_FROM_SLOT    1u /* the slot that REQUEST_CONFIG_BOOT named */
#define CONFIG_FROM_USB     2u /* REQUEST_CONFIG_BEGIN, full */
#define CONFIG_PARTIAL      3u /* REQUEST_CONFIG_BEGIN, partial */
#define CONFIG_FROM_GOLDEN  4u /* the golden slot, because what came before it failed */

/* Where the fields lie. */
#define CONFIG_STATUS_AT_RESULT  1u
#define CONFIG_STATUS_AT_SLOT    2u
#define CONFIG_STATUS_AT_PINS    3u /* bit 0 INIT#, bit 1 DONE */
#define CONFIG_STATUS_AT_BYTES   4u
#define CONFIG_STATUS_AT_TIME_US 8u
#define CONFIG_STATUS_AT_SOURCE  12u
#define CONFIG_STATUS_AT_CAUSE   13u

typedef struct {
    uint8_t result;   /* CONFIG_* */
    uint8_t slot;     /* 0..31 or CONFIG_NO_SLOT */
    uint8_t init;     /* level of INIT# now, 0 or 1 */
    uint8_t done;     /* level of DONE now, 0 or 1 */
    uint32_t bytes;   /* configuration bytes clocked into the FPGA */
    uint32_t time_us; /* from its beginning to the result, in steps of 64, wraps after 4.2 s */
    uint8_t source;   /* CONFIG_FROM_*, CONFIG_PARTIAL */
    uint8_t cause;    /* with CONFIG_FROM_GOLDEN: the result of what failed before it */
} config_status_t;

/* Decode wire[0..15]. Returns 1, or 0 with *status untouched if the version is unknown. */
int config_status_decode(const uint8_t wire[CONFIG_STATUS_SIZE], config_status_t *status);

/* ---- Bitstream store ---- */

/* IN, wValue = wIndex = 0: how the last job on the store stands. */
#define REQUEST_STORE_STATUS 0xB8u
#define STORE_STATUS_SIZE    12u
#define STORE_STATUS_VERSION 1u

/* OUT, alternate setting 2, wValue = first block of STORE_BLOCK bytes (0..7FFF), wIndex = number of
 * blocks (1 .. 8000 - first), no data: read flash; endpoint 86 then gives it. */
#define REQUEST_STORE_READ  0xB9u
#define STORE_BLOCK         512u
#define STORE_BLOCKS        0x8000u
/* OUT, alternate setting 2, wValue = slot 0..31, wIndex = 0, data = slot header (64 bytes); then
 * exactly `length` bytes to endpoint 02. The turret sets the generation itself, writes the bank
 * that does not count and commits it last. STALLs if the header is damaged or names another part.
 */
#define REQUEST_STORE_WRITE 0xBAu
/* OUT, alternate setting 0 or 2, wValue = slot 0..31, wIndex = 0, no data: erase both banks, and
 * with them the slot's marks. */
#define REQUEST_STORE_ERASE 0xBBu
/* OUT, alternate setting 0 or 2, wValue = slot 0..31, wIndex = SLOT_RECORD_DEFAULT or
 * SLOT_RECORD_GOLDEN, no data: this slot is the default, or the golden one, from now on. */
#define REQUEST_STORE_MARK  0xBCu

/* store_status_t.result */
#define STORE_OK             0u
#define STORE_BUSY           1u
#define STORE_NO_FLASH       2u  /* the flash does not answer its CFI query, or is the wrong one */
#define STORE_TIMEOUT        3u  /* the flash stayed busy for longer than its data sheet allows */
#define STORE_ERASE_FAILED   4u  /* a sector is not erased after its erasure */
#define STORE_PROGRAM_FAILED 5u  /* what was programmed reads back differently */
#define STORE_ABORTED        6u  /* as CONFIG_ABORTED */
#define STORE_NO_DATA        7u  /* the host moved nothing for CONFIG_DATA_TIMEOUT_MS */
#define STORE_TOO_LONG       8u  /* the host sent more than it had announced */
#define STORE_EMPTY_SLOT     9u  /* only a slot with a whole bitstream can be marked */
#define STORE_RECORDS_FULL   10u /* no place for another mark: write the slot's bitstream anew */

/* store_status_t.operation: the request's number, 0 if there was none yet */

/* Where the fields lie. */
#define STORE_STATUS_AT_RESULT    1u
#define STORE_STATUS_AT_OPERATION 2u
#define STORE_STATUS_AT_SLOT      3u
#define STORE_STATUS_AT_BYTES     4u
#define STORE_STATUS_AT_DEFAULT   8u
#define STORE_STATUS_AT_GOLDEN    9u

typedef struct {
    uint8_t result;       /* STORE_* */
    uint8_t operation;    /* REQUEST_STORE_* */
    uint8_t slot;         /* that the operation is about; CONFIG_NO_SLOT for a read */
    uint32_t bytes;       /* of bitstream written, or read, so far */
    uint8_t default_slot; /* 0..31 or CONFIG_NO_SLOT */
    uint8_t golden_slot;
} store_status_t;

/* Decode wire[0..11]. Returns 1, or 0 with *status untouched if the version is unknown. */
int store_status_decode(const uint8_t wire[STORE_STATUS_SIZE], store_status_t *status);

/* ---- FPGA registers and cameras ---- */

/* The FPGA's registers (link/registers.h). wIndex = address, 00..7F.
 * IN: 2 bytes, the value; FFFF where there is no register, or no design in the FPGA.
 * OUT without data: wValue = value. FPGA_REG_STREAM only while the alternate setting for streams is
 * chosen. Refused while the flash is in use. */
#define REQUEST_FPGA_REGISTER   0xC0u
/* One register of a camera. wIndex = eye << 8 | register, eye 0 left, 1 right.
 * IN: 1 byte. OUT without data: wValue = value, 00..FF. Refused (STALL) when the camera does not
 * answer: REQUEST_CAMERAS says why. */
#define REQUEST_CAMERA_REGISTER 0xC1u
/* Both cameras, wValue = wIndex = 0. OUT without data: set both up for the format in
 * FPGA_REG_FORMAT; the outcome is in the status. IN: the status, CAMERAS_STATUS_SIZE bytes:
 * CAMERAS_STATUS_VERSION, CAMERA_* (link/camera.h) of the left and of the right eye, 0. */
#define REQUEST_CAMERAS         0xC2u
#define CAMERAS_STATUS_SIZE     4u
#define CAMERAS_STATUS_VERSION  1u

/* ---- The board ---- */

/* IN, wValue = address, wIndex = 0, wLength 1..EEPROM_READ_MAX: that many bytes of the boot EEPROM.
 * STALLs if it does not answer. */
#define REQUEST_EEPROM_READ 0xD0u
#define EEPROM_READ_MAX     64u

/* IN, wValue = 0, wIndex = 7: Microsoft OS 2.0 descriptor set, as the BOS descriptor announces. */
#define REQUEST_MICROSOFT 0xF0u

#endif
