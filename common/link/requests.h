/* USB: what the turret's FX2 answers. docs/SPEC.md section 4 owns grammar and golden bytes.
 *
 * Vendor requests go to the device (bmRequestType 0x40 out, 0xC0 in). Every request has exactly one
 * reply; an unknown or ill-formed one STALLs and changes nothing. 0xA0 (RAM load) belongs to the
 * chip itself. */
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

/* IN, wValue = wIndex = 0: how the FPGA's configuration stands. */
#define REQUEST_CONFIG_STATUS 0xB0u
#define CONFIG_STATUS_SIZE    16u
#define CONFIG_STATUS_VERSION 1u

/* config_status_t.result */
#define CONFIG_OK         0u    /* DONE is high */
#define CONFIG_BUSY       1u    /* still going on */
#define CONFIG_NO_FLASH   2u    /* the flash does not answer its CFI query, or is the wrong one */
#define CONFIG_NO_DEFAULT 3u    /* no slot is marked default */
#define CONFIG_BAD_SLOT   4u    /* the slot holds no whole bitstream */
#define CONFIG_NO_INIT    5u    /* INIT# did not rise after PROG#: no FPGA, or no supply */
#define CONFIG_CRC_ERROR  6u    /* INIT# fell: the FPGA's CRC found the bitstream damaged */
#define CONFIG_NO_DONE    7u    /* all bytes are in but DONE stays low: not a whole bitstream */
#define CONFIG_BUS_STUCK  8u    /* a block did not get from flash to FPGA in its time */
#define CONFIG_NO_SLOT    0xFFu /* config_status_t.slot: none */

typedef struct {
    uint8_t result;   /* CONFIG_* */
    uint8_t slot;     /* 0..31 or CONFIG_NO_SLOT */
    uint8_t init;     /* level of INIT# now, 0 or 1 */
    uint8_t done;     /* level of DONE now, 0 or 1 */
    uint32_t bytes;   /* configuration bytes clocked into the FPGA */
    uint32_t time_us; /* from the 8051's start to the result */
} config_status_t;

/* Encode into wire[0..15]. May be called from an interrupt. */
void config_status_encode(const config_status_t *status, uint8_t wire[CONFIG_STATUS_SIZE]);

/* Decode wire[0..15]. Returns 1, or 0 with *status untouched if the version is unknown. */
int config_status_decode(const uint8_t wire[CONFIG_STATUS_SIZE], config_status_t *status);

#endif
