/* The resident loader: starts the newest whole image, or talks to the PC.
 *
 * It stays if the program asked for it, if no image is whole, or if a HELLO comes while it checks
 * the image: that is how a base is reached whose program does not listen any more. */
#include <stddef.h>

#include "board/boot.h"
#include "board/khepera.h"
#include "board/mc68331.h"
#include "link/loader.h"
#include "loader/line.h"
#include "loader/obey.h"

/* It listens at least so long: long enough for a PC that knocks each 40 ms. Checking an image of
 * some size takes longer anyway. */
#define LISTEN_MS      60u
/* Nothing good heard for so long at another speed: back to the first one. */
#define SPEED_TRIAL_MS 1500u
/* Nothing heard for so long, and there is a program: start it. */
#define PATIENCE_MS    30000u
/* Looks at the line between two looks at clock and watchdog. */
#define LOOKS          32u

extern const uint8_t flash_start[];
void start_program(uint32_t entry) __attribute__((noreturn));
int main(void);

static loader_t loader;
static loader_receiver_t receiver;
/* A HELLO that came during the survey; its sequence number. */
static uint8_t greeted;
static uint8_t greeting;

/* Between two pieces of the survey: is anybody there? */
static void listen(void *context)
{
    uint16_t size;
    int character;

    (void)context;
    line_breathe();
    while ((character = line_read()) >= 0) {
        if (loader_receive(&receiver, (uint8_t)character, &size) &&
            receiver.frame[0] == LOADER_HELLO) {
            greeted = 1;
            greeting = receiver.frame[1];
        }
    }
}

static void breathe(void *context)
{
    (void)context;
    line_breathe();
}

static void restart(void)
{
    line_close();
    boot_mailbox_put(BOOT_RESTART);
    for (;;) {
        /* The watchdog ends this. */
    }
}

static void answer(uint8_t type, uint8_t sequence, const uint8_t *payload, uint16_t size)
{
    static uint8_t reply[LOADER_PAYLOAD_MAX];
    static uint8_t wire[LOADER_WIRE_MAX];
    uint16_t reply_size = loader_obey(&loader, type, payload, size, reply);
    uint16_t count =
        loader_frame_encode((uint8_t)(type | LOADER_REPLY), sequence, reply, reply_size, wire);

    line_write(wire, count);
    if (reply[0] != LOADER_OK)
        return;
    if (type == LOADER_RUN)
        restart();
    if (type == LOADER_SPEED)
        line_open((uint32_t)payload[0] << 24 | (uint32_t)payload[1] << 16 |
                  (uint32_t)payload[2] << 8 | payload[3]);
}

static void serve(void) __attribute__((noreturn));
static void serve(void)
{
    uint32_t heard = clock_ms();
    uint8_t on_trial = 0; /* nothing good has come at the present speed */
    uint8_t looks = 0;

    loader.idle = breathe;
    if (greeted)
        answer(LOADER_HELLO, greeting, receiver.frame, 0);
    loader_receiver_init(&receiver);
    for (;;) {
        uint16_t size;
        int character = line_read();

        if (character >= 0 && loader_receive(&receiver, (uint8_t)character, &size)) {
            on_trial = receiver.frame[0] == LOADER_SPEED;
            answer(receiver.frame[0], receiver.frame[1], receiver.frame + 2, size);
            heard = clock_ms();
        }
        if (++looks % LOOKS != 0)
            continue;
        line_breathe();
        if (on_trial && clock_ms() - heard > SPEED_TRIAL_MS) {
            line_open(BOARD_BAUD);
            on_trial = 0;
        }
        if (loader.active != LOADER_NO_BANK && clock_ms() - heard > PATIENCE_MS)
            restart();
    }
}

static void start(void) __attribute__((noreturn));
static void start(void)
{
    const uint32_t *from =
        (const uint32_t *)(const void *)(flash_start + loader_program_address(&loader));
    uint32_t *to = (uint32_t *)loader.image.load;
    uint32_t longs = (loader.image.length + 3) / 4;

    line_close();
    for (; longs > 0; longs--) {
        *to++ = *from++;
        if (longs % 1024 == 0)
            line_breathe();
    }
    line_breathe();
    start_program(loader.image.entry);
}

int main(void)
{
    uint32_t word = RSR & RSR_POWER ? 0 : boot_mailbox_word();

    /* A crash or a reset from outside later must not be taken for one that was asked for. */
    boot_mailbox_put(word == BOOT_RESTART ? BOOT_CAUSE_ASKED : 0);
    clock_start();
    line_open(BOARD_BAUD);
    loader_receiver_init(&receiver);
    loader.bus = &flash_board_bus;
    loader.memory = flash_start;
    loader.idle = listen;
    loader_init(&loader);
    loader_survey(&loader);
    while (!greeted && clock_ms() < LISTEN_MS)
        listen(NULL);
    if (greeted)
        loader.why = LOADER_WHY_HELLO;
    if (word == BOOT_STAY)
        loader.why = LOADER_WHY_ASKED;
    if (word != BOOT_STAY && !greeted && loader.active != LOADER_NO_BANK)
        start();
    serve();
}
