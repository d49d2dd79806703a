/* The GPIF's waveforms (gpif_waveforms.c), numbered as in GPIFWFSELECT. */
#ifndef DRIVERS_GPIF_WAVEFORMS_H
#define DRIVERS_GPIF_WAVEFORMS_H

#include "drivers/compiler.h"

#include <stdint.h>

enum { WAVE_READ = 0, WAVE_WRITE = 1, WAVE_FLASH_STREAM = 2, WAVE_USB_STREAM = 3 };

/* Each has four groups of bytes, one for each state. Of the eight places for them no waveform needs
 * more than the first four. */
enum { WAVE_STATES = 4, WAVE_PLACES = 8, WAVEFORMS_SIZE = 4 * 4 * WAVE_STATES };

#ifndef WAVEFORMS_LAYOUT_ONLY
extern XDATA AT(0xE18A) uint8_t gpif_waveforms[WAVEFORMS_SIZE];
#endif

#endif
