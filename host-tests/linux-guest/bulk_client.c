/* Streams a 16-bit counter through a bulk endpoint of the FX2's default device, with the kernel's
 * usbfs: several transfers under way, pauses of random length, and every byte checked.
 *
 *   bulk_client DEVICE_FILE in|out KIBIBYTES SEED
 *
 * "in" reads endpoint 0x86 and checks that it counts; "out" writes a counter to endpoint 0x02,
 * which the other side checks. Exit code 0 if everything arrived. */
#include <errno.h>
#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

enum { TRANSFERS = 6, TRANSFER_SIZE = 16384, ENDPOINT_IN = 0x86, ENDPOINT_OUT = 0x02 };
enum { TIMEOUT_MS = 10000, PAUSE_MAX_US = 20000 };

typedef struct {
    struct usbdevfs_urb urb;
    unsigned char data[TRANSFER_SIZE];
} transfer_t;

static transfer_t transfers[TRANSFERS];
static uint16_t next_word;
static uint32_t seed;

static _Noreturn void fail(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, strerror(errno));
    exit(1);
}

static uint32_t random_below(uint32_t limit)
{
    seed = seed * 1664525u + 1013904223u;
    return (seed >> 8) % limit;
}

static void submit(int device, transfer_t *transfer, int reads)
{
    memset(&transfer->urb, 0, sizeof transfer->urb);
    transfer->urb.type = USBDEVFS_URB_TYPE_BULK;
    transfer->urb.endpoint = reads ? ENDPOINT_IN : ENDPOINT_OUT;
    transfer->urb.buffer = transfer->data;
    transfer->urb.buffer_length = TRANSFER_SIZE;
    transfer->urb.usercontext = transfer;
    if (!reads) {
        for (int i = 0; i < TRANSFER_SIZE; i += 2, next_word++) {
            transfer->data[i] = (unsigned char)(next_word & 0xFFu);
            transfer->data[i + 1] = (unsigned char)(next_word >> 8);
        }
    }
    if (ioctl(device, USBDEVFS_SUBMITURB, &transfer->urb) != 0)
        fail("submit");
}

static transfer_t *reap(int device)
{
    struct pollfd waiting = {.fd = device, .events = POLLOUT};
    if (poll(&waiting, 1, TIMEOUT_MS) <= 0) {
        errno = ETIMEDOUT;
        fail("wait");
    }
    struct usbdevfs_urb *urb = NULL;
    if (ioctl(device, USBDEVFS_REAPURBNDELAY, &urb) != 0)
        fail("reap");
    if (urb->status != 0 || urb->actual_length != TRANSFER_SIZE) {
        fprintf(stderr, "transfer ended with status %d and %d bytes\n", urb->status,
                urb->actual_length);
        exit(1);
    }
    return urb->usercontext;
}

static void check(const transfer_t *transfer)
{
    for (int i = 0; i < TRANSFER_SIZE; i += 2, next_word++) {
        const unsigned word = transfer->data[i] | (unsigned)transfer->data[i + 1] << 8;
        if (word != next_word) {
            fprintf(stderr, "word %#x came where %#x was due, byte %d\n", word, (unsigned)next_word,
                    i);
            exit(1);
        }
    }
}

int main(int argc, char **argv)
{
    if (argc != 5 || (strcmp(argv[2], "in") != 0 && strcmp(argv[2], "out") != 0)) {
        fprintf(stderr, "usage: bulk_client DEVICE_FILE in|out KIBIBYTES SEED\n");
        return 2;
    }
    const int reads = strcmp(argv[2], "in") == 0;
    const long total = strtol(argv[3], NULL, 10) * 1024 / TRANSFER_SIZE;
    seed = (uint32_t)strtoul(argv[4], NULL, 10);

    const int device = open(argv[1], O_RDWR);
    if (device < 0)
        fail(argv[1]);
    unsigned interface = 0;
    if (ioctl(device, USBDEVFS_CLAIMINTERFACE, &interface) != 0)
        fail("claim");
    struct usbdevfs_setinterface setting = {.interface = 0, .altsetting = 1};
    if (ioctl(device, USBDEVFS_SETINTERFACE, &setting) != 0)
        fail("set interface");

    long submitted = 0;
    for (; submitted < TRANSFERS && submitted < total; submitted++)
        submit(device, &transfers[submitted], reads);
    for (long done = 0; done < total; done++) {
        if (random_below(8) == 0)
            usleep(random_below(PAUSE_MAX_US));
        transfer_t *transfer = reap(device);
        if (reads)
            check(transfer);
        if (submitted < total) {
            submit(device, transfer, reads);
            submitted++;
        }
    }
    printf("%ld transfers of %d bytes\n", total, TRANSFER_SIZE);
    return 0;
}
