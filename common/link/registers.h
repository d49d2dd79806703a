/* The FPGA's register file: 8-bit addresses 00..7F, 16-bit values.
 *
 * The FX2 reaches it over SPI, the 68331 in the words it sends while it clocks a report out.
 * docs/SPEC.md section 2 owns both framings and gives golden bytes. */
#ifndef LINK_REGISTERS_H
#define LINK_REGISTERS_H

#include <stdint.h>

/* address               reset   meaning */
#define FPGA_REG_ID           0x00u /* ro: FPGA_ID_VALUE once configured */
#define FPGA_REG_FUNCTION     0x01u /* ro: FPGA_FUNCTION_* (link/report.h) */
#define FPGA_REG_STREAM       0x02u /* rw, 0: 1 lets the streaming pins drive FD[15:0] */
#define FPGA_REG_FRAME_COUNT  0x03u /* ro: frames taken since configuration, wraps */
#define FPGA_REG_GOAL_ROW     0x04u /* rw, 60: row of the goal's epipolar line, 4..235 */
#define FPGA_REG_OPPONENT_ROW 0x05u /* rw, 80: row of the opponent's epipolar line, 4..235 */
#define FPGA_REG_SEARCH_MAX   0x06u /* rw, 79: largest disparity searched, 16..127 px */
#define FPGA_REG_FRAME_RATE   0x07u /* rw, 40: frames per second, 1..40 */
#define FPGA_REG_COUNT        0x08u

#define FPGA_ID_VALUE 0x5301u /* 'S', register map 1 */

/* SPI (mode 0, most significant bit first, SS# low for the whole of it): one address byte, then two
 * value bytes. Bit 7 of the address set = write; else the value is read. */
#define FPGA_SPI_WRITE 0x80u
#define FPGA_SPI_BYTES 3u

/* A write by the base: words 0..2 of the 16 it sends while it clocks a report out:
 * REGISTER_WORD_WRITE | address, value, CRC-16/CCITT-FALSE over those four bytes.
 * A first word without REGISTER_WORD_WRITE, or a wrong CRC, changes nothing. */
#define REGISTER_WORD_WRITE  0x8000u
#define REGISTER_WRITE_BYTES 6u

/* Encode such a write into wire[0..5]. Address 00..7F. May be called from an interrupt. */
void register_write_encode(uint8_t address, uint16_t value, uint8_t wire[REGISTER_WRITE_BYTES]);

/* Decode wire[0..5]. Returns 1 and fills both, or 0 (no write, or a damaged one) and fills none. */
int register_write_decode(const uint8_t wire[REGISTER_WRITE_BYTES], uint8_t *address,
                          uint16_t *value);

#endif
