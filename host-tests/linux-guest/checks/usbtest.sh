# The kernel's own test driver against our firmware: its alternate setting 1 takes what comes and gives
# packets of zeros, as the driver's source and sink want.
#
# device: tested $sot twin fx2 $firmware
# device: tested_slow $sot twin fx2 $firmware --speed full
# compile: usbtest_client.c

# The driver takes devices of this name from here on, with the endpoints of that alternate setting.
bind_usbtest() {
    appears "$tested" 1209:0001 480 && appears "$tested_slow" 1209:0001 12 &&
        insmod /modules/usbtest.ko vendor=0x1209 product=0x0001 alt=1 || return 1
    local port
    for port in "$tested" "$tested_slow"; do
        [ -e "/sys/bus/usb/drivers/usbtest/1-$port:1.0" ] || {
            echo "no driver took port $port"
            dmesg | tail -n 10
            return 1
        }
    done
}

usbtest() { # usbtest PORT CASE ITERATIONS LENGTH VARY SGLEN
    local port=$1
    shift
    # Nothing of the driver has an end of its own if the device hangs.
    timeout 12 usbtest_client "$(node "$port")" "$@" || {
        dmesg | tail -n 5
        return 1
    }
}

# At both speeds: writes and reads of whole packets, of lengths that vary, and in scatter lists.
bulk_cases() { # bulk_cases PORT ITERATIONS
    local case
    usbtest "$1" 1 "$2" 2048 0 1 && usbtest "$1" 2 "$2" 2048 0 1 &&
        usbtest "$1" 3 "$2" 2048 512 1 && usbtest "$1" 4 "$2" 2048 512 1 || return 1
    for case in 5 6; do
        usbtest "$1" $case "$2" 2048 0 4 || return 1
    done
    for case in 7 8; do
        usbtest "$1" $case "$2" 2048 512 4 || return 1
    done
}

control_cases() { # control_cases PORT
    usbtest "$1" 9 20 256 0 1 && usbtest "$1" 10 20 256 0 8
}

# Not case 24, which unlinks two of many queued writes: QEMU 7.2's controller takes all of them back from
# the device and, when the endpoint goes on, does not submit the others again, whatever the device answers.
unlink_cases() { # unlink_cases PORT
    usbtest "$1" 11 20 2048 0 1 && usbtest "$1" 12 20 2048 0 1
}

unaligned_cases() { # unaligned_cases PORT
    local case
    for case in 17 18 19 20; do
        usbtest "$1" $case 10 2048 0 1 || return 1
    done
}

check "the kernel's usbtest takes our firmware at both speeds" bind_usbtest
check 'usbtest writes and reads at high speed' bulk_cases "$tested" 20
check 'usbtest writes and reads at full speed' bulk_cases "$tested_slow" 5
check 'usbtest is content with control transfers at high speed' control_cases "$tested"
check 'usbtest is content with control transfers at full speed' control_cases "$tested_slow"
check 'usbtest unlinks transfers' unlink_cases "$tested"
check 'usbtest sets and clears halts' usbtest "$tested" 13 10 2048 0 1
check 'usbtest reads and writes unaligned buffers' unaligned_cases "$tested"
