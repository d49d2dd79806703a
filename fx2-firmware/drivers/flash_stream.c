#include "drivers/flash_stream.h"

#include "drivers/fx2_regs.h"
#include "drivers/gpif.h"
#include "drivers/gpif_ctl.h"

/* 512 bytes take 640 CPU cycles, a poll takes 9: twice the time a block needs. */
#define POLLS_MAX 160u

static uint16_t next_block;

static const CODE register_value_t begin_table[] = {
    {XREG_ADDRESS(GPIFIDLECTL), WE_N},
    /* All but TCB1 is 0 whenever a block begins: the count before has expired. */
    {XREG_ADDRESS(GPIFTCB3), 0},
    {XREG_ADDRESS(GPIFTCB2), 0},
    {XREG_ADDRESS(GPIFTCB0), 0},
};

void flash_stream_begin(uint16_t block)
{
    next_block = block;
    gpif_set_offset(0); /* after 512 bytes GPIFADR[8:0] is there again by itself */
    registers_set(begin_table, sizeof begin_table / sizeof begin_table[0]);
}

void flash_stream_end(void)
{
    GPIFIDLECTL = REST;
}

ONCE uint8_t await_done(void)
{
    uint8_t polls = POLLS_MAX;

    do {
        if (GPIFTRIG & GPIFTRIG_DONE)
            return 1;
    } while (--polls);
    GPIFABORT = 0xFF;
    return 0;
}

/* Everything in this loop but the waiting costs the stream time. The samples that the GPIF takes in
 * passing go to EP6 and are thrown away before each block, which always fits its first buffer: what
 * becomes of a sample without room does not matter. The host is held off meanwhile, as a FIFO's
 * reset demands. */
uint8_t flash_stream_blocks(uint8_t count)
{
    uint8_t done;

    FIFORESET = FIFORESET_NAKALL;
    SYNCDELAY();
    do {
        IOD = (uint8_t)next_block;
        IOE = (uint8_t)(next_block >> 8);
        next_block++;
        FIFORESET = FIFORESET_NAKALL | 6;
        SYNCDELAY();
        GPIFTCB1 = TURRET_FLASH_BLOCK >> 8;
        SYNCDELAY();
        GPIFTRIG = GPIFTRIG_READ | GPIFTRIG_EP6;
        SYNCDELAY();
        done = await_done();
    } while (done && --count);
    FIFORESET = 0;
    SYNCDELAY();
    return done;
}
