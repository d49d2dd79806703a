/* Streaming from the FPGA to USB, endpoint 86 of alternate setting 3.
 *
 * Start, stop, format and source are registers of the FPGA (link/registers.h), which the host
 * writes with REQUEST_FPGA_REGISTER; this only gives the FPGA the way and takes it back. */
#ifndef APP_STREAM_H
#define APP_STREAM_H

/* The alternate setting is chosen: an empty endpoint, and an FPGA that does not stream yet. Also
 * when it was open already. */
void stream_open(void);

/* It is left, at whatever moment: the FPGA lets go of the pins, and what was not fetched is gone.
 * The flash may be used again. */
void stream_close(void);

#endif
