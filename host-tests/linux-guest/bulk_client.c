/* Streams a 16-bit counter through a bulk endpoint of the FX2's default device, with the kernel's
 * usbfs: several transfers under way, pauses of random length, now and then everything cancelled
 * and taken up again, and every byte checked.
 *
 *   bulk_client DEVICE_FILE in|out KIBIBYTES SEED
 *
 * "in" reads endpoint 0x86 and checks that it counts: of what was cancelled, nothing may be
 * missing. "out" writes a counter to endpoint 0x02, which the other side checks; of a cancelled
 * write the client cannot know how much went out, so it goes on behind it and says "cancelled FIRST
 * COUNT" in words. Exit code 0 if everything arrived. */
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
/* One in so many transfers is preceded by a pause, by a cancellation of all. */
enum { PAUSE_RATE = 8, CANCEL_RATE = 12 };

typedef struct {
    struct usbdevfs_urb urb;
    unsigned char data[TRANSFER_SIZE];
    uint64_t first; /* its first word, counted on beyond 16 bits */
    int moved;      /* bytes */
    int under_way;
    int cancelled;
} transfer_t;

/* The transfers in the order of their data: `count` of them from `first` on. */
static transfer_t transfers[TRANSFERS];
static int first;
static int count;
static int device;
static int reads;
static uint64_t next_word;
static uint32_t seed;
static long cancellations;

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

static transfer_t *nth(int n)
{
    return &transfers[(first + n) % TRANSFERS];
}

static void submit(transfer_t *transfer)
{
    memset(&transfer->urb, 0, sizeof transfer->urb);
    transfer->urb.type = USBDEVFS_URB_TYPE_BULK;
    transfer->urb.endpoint = reads ? ENDPOINT_IN : ENDPOINT_OUT;
    transfer->urb.buffer = transfer->data;
    transfer->urb.buffer_length = TRANSFER_SIZE;
    transfer->urb.usercontext = transfer;
    if (ioctl(device, USBDEVFS_SUBMITURB, &transfer->urb) != 0)
        fail("submit");
    transfer->under_way = 1;
}

static void start_next(void)
{
    transfer_t *transfer = nth(count++);
    transfer->moved = 0;
    transfer->first = next_word;
    for (int i = 0; i < TRANSFER_SIZE && !reads; i += 2, next_word++) {
        transfer->data[i] = (unsigned char)(next_word & 0xFFu);
        transfer->data[i + 1] = (unsigned char)(next_word >> 8 & 0xFFu);
    }
    submit(transfer);
}

static void reap_one(void)
{
    struct pollfd waiting = {.fd = device, .events = POLLOUT};
    if (poll(&waiting, 1, TIMEOUT_MS) <= 0) {
        errno = ETIMEDOUT;
        fail("wait");
    }
    struct usbdevfs_urb *urb = NULL;
    if (ioctl(device, USBDEVFS_REAPURBNDELAY, &urb) != 0)
        fail("reap");
    const int cancelled = urb->status == -ENOENT || urb->status == -ECONNRESET;
    const int whole = urb->status == 0 && urb->actual_length == urb->buffer_length;
    if (!cancelled && !whole) {
        fprintf(stderr, "transfer ended with status %d and %d bytes\n", urb->status,
                urb->actual_length);
        exit(1);
    }
    transfer_t *transfer = urb->usercontext;
    transfer->moved = urb->actual_length;
    transfer->cancelled = cancelled;
    transfer->under_way = 0;
}

/* The newest first, as libusb's users do it: no transfer overtakes a cancelled one. */
static void cancel_all(void)
{
    for (int n = count - 1; n >= 0; n--)
        if (ioctl(device, USBDEVFS_DISCARDURB, &nth(n)->urb) != 0 && errno != EINVAL)
            fail("cancel");
    for (int n = 0; n < count; n++)
        while (nth(n)->under_way)
            reap_one();
    cancellations++;
}

static void check(const transfer_t *transfer)
{
    for (int i = 0; i + 1 < transfer->moved; i += 2, next_word++) {
        const unsigned word = transfer->data[i] | (unsigned)transfer->data[i + 1] << 8;
        if (word != (next_word & 0xFFFFu)) {
            fprintf(stderr, "word %#x came where %#x was due, byte %d, %ld cancellations\n", word,
                    (unsigned)(next_word & 0xFFFFu), i, cancellations);
            exit(1);
        }
    }
}

/* Takes finished transfers off the list; returns the bytes that are dealt with. */
static long settle(void)
{
    long bytes = 0;
    while (count > 0 && !nth(0)->under_way) {
        if (reads)
            check(nth(0));
        else if (nth(0)->cancelled)
            printf("cancelled %llu %d\n", (unsigned long long)nth(0)->first, TRANSFER_SIZE / 2);
        bytes += reads ? nth(0)->moved : TRANSFER_SIZE;
        first = (first + 1) % TRANSFERS;
        count--;
    }
    return bytes;
}

static void open_device(const char *path)
{
    device = open(path, O_RDWR);
    if (device < 0)
        fail(path);
    unsigned interface = 0;
    if (ioctl(device, USBDEVFS_CLAIMINTERFACE, &interface) != 0)
        fail("claim");
    struct usbdevfs_setinterface setting = {.interface = 0, .altsetting = 1};
    if (ioctl(device, USBDEVFS_SETINTERFACE, &setting) != 0)
        fail("set interface");
}

int main(int argc, char **argv)
{
    if (argc != 5 || (strcmp(argv[2], "in") != 0 && strcmp(argv[2], "out") != 0)) {
        fprintf(stderr, "usage: bulk_client DEVICE_FILE in|out KIBIBYTES SEED\n");
        return 2;
    }
    reads = strcmp(argv[2], "in") == 0;
    const long total = strtol(argv[3], NULL, 10) * 1024;
    seed = (uint32_t)strtoul(argv[4], NULL, 10);
    open_device(argv[1]);

    long moved = 0;
    while (moved < total) {
        while (count < TRANSFERS && moved + (long)count * TRANSFER_SIZE < total)
            start_next();
        if (random_below(PAUSE_RATE) == 0)
            usleep(random_below(PAUSE_MAX_US));
        if (random_below(CANCEL_RATE) == 0)
            cancel_all();
        while (nth(0)->under_way)
            reap_one();
        moved += settle();
    }
    printf("%ld bytes, %ld cancellations\n", moved, cancellations);
    return 0;
}
