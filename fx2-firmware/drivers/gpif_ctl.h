/* Levels of the pins CTL[5:0], for the drivers that set them. */
#ifndef DRIVERS_GPIF_CTL_H
#define DRIVERS_GPIF_CTL_H

#include "board/turret.h"

#define CCLK (1u << TURRET_CTL_CCLK)
#define OE_N (1u << TURRET_CTL_FLASH_OE)
#define WE_N (1u << TURRET_CTL_FLASH_WE)
#define REST (OE_N | WE_N)

#endif
