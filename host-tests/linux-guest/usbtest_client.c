/* Runs one case of the kernel's usbtest driver, which must be bound to the device's interface 0.
 *
 *   usbtest_client DEVICE_FILE CASE ITERATIONS LENGTH VARY SGLEN
 *
 * The cases are those of drivers/usb/misc/usbtest.c. Exit code 0 if the case passed. */
#include <errno.h>
#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>

/* The driver's interface, which no header exports. */
struct usbtest_param {
    uint32_t test_num;
    uint32_t iterations;
    uint32_t length;
    uint32_t vary;
    uint32_t sglen;
    int32_t duration_sec;
    int32_t duration_usec;
};
#define USBTEST_REQUEST _IOWR('U', 100, struct usbtest_param)

enum { ARGUMENTS = 7 };

int main(int argc, char **argv)
{
    if (argc != ARGUMENTS) {
        fprintf(stderr, "usage: usbtest_client DEVICE_FILE CASE ITERATIONS LENGTH VARY SGLEN\n");
        return 2;
    }
    struct usbtest_param test = {
        .test_num = (uint32_t)strtoul(argv[2], NULL, 10),
        .iterations = (uint32_t)strtoul(argv[3], NULL, 10),
        .length = (uint32_t)strtoul(argv[4], NULL, 10),
        .vary = (uint32_t)strtoul(argv[5], NULL, 10),
        .sglen = (uint32_t)strtoul(argv[6], NULL, 10),
    };
    struct usbdevfs_ioctl wrapped = {
        .ifno = 0,
        .ioctl_code = (int)USBTEST_REQUEST,
        .data = &test,
    };
    const int device = open(argv[1], O_RDWR);
    if (device < 0) {
        perror(argv[1]);
        return 1;
    }
    if (ioctl(device, USBDEVFS_IOCTL, &wrapped) < 0) {
        fprintf(stderr, "case %u: %s\n", test.test_num, strerror(errno));
        return 1;
    }
    printf("case %u: %d.%06d s\n", test.test_num, test.duration_sec, test.duration_usec);
    return 0;
}
