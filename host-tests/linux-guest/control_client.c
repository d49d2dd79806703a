/* One control transfer to a USB device, with the kernel's usbfs.
 *
 *   control_client DEVICE_FILE in TYPE REQUEST VALUE INDEX LENGTH     prints what came, in hex
 *   control_client DEVICE_FILE out TYPE REQUEST VALUE INDEX [HEX]     sends the bytes
 *
 * Numbers as in C; TYPE is bmRequestType without its direction bit (0x40 = vendor, device). Exit
 * code 0 if the device accepted it, 1 if not (with errno's text: EPIPE "Broken pipe" is a stall).
 */
#include <errno.h>
#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>

enum { LENGTH_MAX = 4096, TIMEOUT_MS = 5000, FIXED_ARGUMENTS = 7 };

static int usage(void)
{
    fprintf(stderr, "usage: control_client DEVICE_FILE in TYPE REQUEST VALUE INDEX LENGTH\n"
                    "       control_client DEVICE_FILE out TYPE REQUEST VALUE INDEX [HEX]\n");
    return 2;
}

static unsigned long number(const char *text, unsigned long max)
{
    char *end = NULL;
    const unsigned long value = strtoul(text, &end, 0);
    if (end == text || *end != '\0' || value > max) {
        fprintf(stderr, "%s is no number up to %lu\n", text, max);
        exit(2);
    }
    return value;
}

static uint16_t parse_hex(const char *text, unsigned char *data)
{
    const size_t length = strlen(text) / 2;
    if (length > LENGTH_MAX || strlen(text) % 2 != 0) {
        fprintf(stderr, "%zu hex digits are no bytes, or too many\n", strlen(text));
        exit(2);
    }
    for (size_t n = 0; n < length; n++) {
        const char digits[] = {text[2 * n], text[2 * n + 1], '\0'};
        char *end = NULL;
        data[n] = (unsigned char)strtoul(digits, &end, 16);
        if (*end != '\0') {
            fprintf(stderr, "%s is no byte in hex\n", digits);
            exit(2);
        }
    }
    return (uint16_t)length;
}

int main(int argc, char **argv)
{
    static unsigned char data[LENGTH_MAX];
    if (argc < FIXED_ARGUMENTS || argc > FIXED_ARGUMENTS + 1)
        return usage();
    const int reads = strcmp(argv[2], "in") == 0;
    if ((!reads && strcmp(argv[2], "out") != 0) || (reads && argc != FIXED_ARGUMENTS + 1))
        return usage();

    struct usbdevfs_ctrltransfer transfer = {
        .bRequestType = (uint8_t)(number(argv[3], 0x7F) | (reads ? 0x80u : 0u)),
        .bRequest = (uint8_t)number(argv[4], 0xFF),
        .wValue = (uint16_t)number(argv[5], 0xFFFF),
        .wIndex = (uint16_t)number(argv[6], 0xFFFF),
        .timeout = TIMEOUT_MS,
        .data = data,
    };
    if (reads)
        transfer.wLength = (uint16_t)number(argv[7], LENGTH_MAX);
    else if (argc > FIXED_ARGUMENTS)
        transfer.wLength = parse_hex(argv[7], data);

    const int device = open(argv[1], O_RDWR);
    if (device < 0) {
        perror(argv[1]);
        return 1;
    }
    const int moved = ioctl(device, USBDEVFS_CONTROL, &transfer);
    if (moved < 0) {
        perror("control transfer");
        return 1;
    }
    for (int n = 0; reads && n < moved; n++)
        printf("%02x", data[n]);
    if (reads)
        printf("\n");
    return 0;
}
