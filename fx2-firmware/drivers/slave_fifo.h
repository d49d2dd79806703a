/* EP6 as a slave FIFO that the FPGA fills: 16 bits at 30 MHz, packets sent by themselves (AUTOIN),
 * four buffers. The CPU has no part in the bytes' way.
 *
 * While it is open, FD[15:0] belong to the FPGA: nobody may use the GPIF or the flash. Nothing here
 * may be called from an interrupt. */
#ifndef DRIVERS_SLAVE_FIFO_H
#define DRIVERS_SLAVE_FIFO_H

/* Open it, with packets of usb_bulk_packet bytes. The endpoint is empty (drivers/usb_bulk.h), the
 * FPGA's streaming pins float. */
void slave_fifo_open(void);

/* Back to the GPIF; the caller throws away what is in the buffers. The FPGA's streaming pins float.
 */
void slave_fifo_close(void);

#endif
