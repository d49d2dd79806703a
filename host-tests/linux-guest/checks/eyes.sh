# Both eyes over the kernel's USB, by `sot` in the guest: thirty seconds at 320x240 and 40 pairs a second,
# 12.3 MB/s. The emulated PC may be too slow for that; what it loses must be counted alike on both sides.
#
# device: robot $sot twin robot --serial EYES00000001
# program: $sot

recorded() { # recorded SECONDS: into nowhere, the index beside it is small
    sot stream record /dev/null --force --seconds "$1" --json --robot usb:EYES00000001 >/tmp/record || {
        cat /tmp/record
        return 1
    }
    cat /tmp/record
    rm -f /dev/null.index
    grep -q '"counts_agree":true' /tmp/record && ! grep -q '"pairs":0,' /tmp/record
}

field() { # field NAME: of the record, as its first number
    sed "s/.*\"$1\":\([0-9]*\).*/\1/" /tmp/record
}

check 'a robot with two eyes enumerates' appears "$robot" 1209:0001 480
check 'sot finds both cameras' sot camera probe --robot usb:EYES00000001
check 'thirty seconds of stream: both sides count the same' recorded 30
echo "note of $(($(field sent) + $(field lost))) pairs $(field lost) were lost" >/dev/console
