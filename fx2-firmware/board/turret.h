/* The turret's wiring around the FX2 (128-pin package).
 *
 * Nobody outside the makers knows the real pin assignment: every number here is an ASSUMPTION of
 * ours. This is its only home; firmware and twin both read it. Plain numbers only, so that any
 * compiler can read it. Directions are seen from the FX2. */
#ifndef BOARD_TURRET_H
#define BOARD_TURRET_H

/* FD[7:0]: flash DQ[7:0] and FPGA D[0..7], with FD7 = FPGA D0 (Virtex's most significant bit), so
 * one byte can go from flash to FPGA in flight and no bit is ever swapped in software. */

/* Flash address: A[8:0] = GPIFADR[8:0] (PC[7:0] and PE7), A[16:9] = PD[7:0], A[23:17] = PE[6:0]. */
#define TURRET_FLASH_BLOCK     512u /* bytes reached by GPIFADR alone */
#define TURRET_PE_ADDRESS_MASK 0x7Fu

/* CTL pins, as bit numbers. */
#define TURRET_CTL_CCLK     3 /* FPGA configuration clock */
#define TURRET_CTL_FLASH_OE 4 /* flash OE#, active low */
#define TURRET_CTL_FLASH_WE 5 /* flash WE#, active low */

/* Port A, as bit numbers; all four have pull-ups. */
#define TURRET_PA_PROG     0 /* FPGA PROG#, active low */
#define TURRET_PA_FLASH_CE 1 /* flash CE#, active low */
#define TURRET_PA_FPGA_CS  3 /* FPGA CS# of SelectMAP, active low; its WRITE# is tied low */
#define TURRET_PA_SPI_SS   7 /* SS# of the FPGA's register port, active low */
/* PA2, PA4, PA5, PA6 and RDY0, RDY1 belong to the slave FIFO. */

/* RDY pins, as bit numbers of GPIFREADYSTAT. */
#define TURRET_RDY_INIT  2 /* FPGA INIT#: low while it clears itself, and after a CRC error */
#define TURRET_RDY_DONE  3 /* FPGA DONE */
#define TURRET_RDY_FLASH 4 /* flash RY/BY#: high = ready */

/* Port C as SPI to the FPGA's registers, only while flash CE# is high and PORTCCFG = 0. */
#define TURRET_PC_SPI_SCK  0
#define TURRET_PC_SPI_MOSI 1
#define TURRET_PC_SPI_MISO 2

/* I2C: the boot EEPROM (two address bytes, 24LC128 class). 7-bit address. */
#define TURRET_EEPROM_ADDRESS     0x51
#define TURRET_EEPROM_SIZE        16384u
/* The cameras: OV7670 class, all at one address, behind a PCA9540B. 7-bit addresses. A channel is
 * chosen by writing its number to the multiplexer; 0 chooses none. */
#define TURRET_CAMERA_MUX_ADDRESS 0x70
#define TURRET_CAMERA_MUX_LEFT    0x04
#define TURRET_CAMERA_MUX_RIGHT   0x05
#define TURRET_CAMERA_ADDRESS     0x21

/* Flash: AMD command set, CFI, 128 Mbit as M29W128FH x8, 64 KiB sectors. */
#define TURRET_FLASH_ACCESS_NS  70
/* The FPGA, as .bit files name it. */
#define TURRET_FPGA_PART        "v300ecs144"
/* Virtex-E SelectMAP, XCV300E-6 (from memory of DS022, not confirmed): data set-up and hold at
 * CCLK's rising edge, longest CCLK without BUSY, shortest PROG# pulse. */
#define TURRET_FPGA_SETUP_NS    5
#define TURRET_FPGA_HOLD_NS     0
#define TURRET_FPGA_CCLK_MAX_HZ 50000000
#define TURRET_FPGA_PROG_MIN_NS 300

#endif
