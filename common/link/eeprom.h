/* The turret's boot EEPROM (24LC128 class, 16 KiB, pages of 64 bytes) and the program that writes
 * it.
 *
 *   0000 ..  boot image (C2 format of the FX2); byte 0 = FF: the chip starts blank
 *   3FC0     serial number, 16 bytes: 'S', 'N', 12 characters 0-9 or A-Z, CRC-16 of bytes 0..13
 *
 * It is written by a small program of its own, the EEPROM loader, which the host puts into the
 * FX2's RAM by request A0 and starts. The loader leaves the USB connection as it is and answers
 * nothing but the requests here, until a bus reset, which gives USB back to the chip's own logic.
 * docs/SPEC.md section 4 owns grammar and golden bytes. */
#ifndef LINK_EEPROM_H
#define LINK_EEPROM_H

#include <stdint.h>

#define EEPROM_PAGE 64u

#define EEPROM_SERIAL_AT       0x3FC0u
#define EEPROM_SERIAL_SIZE     16u
#define EEPROM_SERIAL_TEXT_AT  2u
#define EEPROM_SERIAL_TEXT     12u
#define EEPROM_SERIAL_AT_CRC16 14u

/* Encode the serial number text[0..11] into wire[0..15]. */
void eeprom_serial_encode(const char text[EEPROM_SERIAL_TEXT], uint8_t wire[EEPROM_SERIAL_SIZE]);

/* 1 if wire[0..15] hold a serial number: text at EEPROM_SERIAL_TEXT_AT. */
uint8_t eeprom_serial_check(const uint8_t wire[EEPROM_SERIAL_SIZE]);

/* First byte of the EEPROM: while an image is being written, and once it is whole. */
#define EEPROM_BLANK 0xFFu
#define EEPROM_BOOT  0xC2u

/* The loader's requests: vendor, to the device. A failed one STALLs, and LOADER_STATUS says why. */

/* IN, wValue = wIndex = 0, 4 bytes: LOADER_VERSION, result of the last other request (LOADER_*), 1
 * between BEGIN and COMMIT, 0. */
#define REQUEST_LOADER_STATUS 0xE0u
#define LOADER_STATUS_SIZE    4u
#define LOADER_VERSION        1u
/* OUT, wValue = wIndex = 0, no data: byte 0 becomes EEPROM_BLANK. From now on a turret that loses
 * power starts as a blank chip. */
#define REQUEST_LOADER_BEGIN  0xE1u
/* OUT, wValue = address, wIndex = 0, 1..64 bytes of data that do not cross the end of a page:
 * write and read back. Below EEPROM_SERIAL_AT only after BEGIN, and byte 0 stays EEPROM_BLANK
 * whatever it is told; at EEPROM_SERIAL_AT at any time. Takes up to 5 ms. */
#define REQUEST_LOADER_WRITE  0xE2u
/* OUT, wValue = length of the image, wIndex = CRC-16 of its bytes, the first of which counts as
 * EEPROM_BOOT; no data: if that is what the EEPROM holds, byte 0 becomes EEPROM_BOOT. */
#define REQUEST_LOADER_COMMIT 0xE3u
/* IN, wValue = address, wIndex = 0, wLength 1..64: that many bytes. */
#define REQUEST_LOADER_READ   0xE4u

#define LOADER_OK        0u
#define LOADER_NO_EEPROM 1u /* no acknowledge at its address */
#define LOADER_TIMEOUT   2u /* a page was not written after 20 ms */
#define LOADER_DIFFERS   3u /* what was written reads back differently: write-protected or worn */
#define LOADER_BAD_CRC   4u /* COMMIT: the EEPROM holds something else */
#define LOADER_NOT_BEGUN 5u /* WRITE or COMMIT without BEGIN */
#define LOADER_REFUSED   6u /* not a request of this form */

#endif
