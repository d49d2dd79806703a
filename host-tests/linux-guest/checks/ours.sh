# Our own firmware at both speeds, without a turret around it.
#
# device: ours $sot twin fx2 $firmware
# device: ours_slow $sot twin fx2 $firmware --speed full

# Alternate setting 1: 02 takes what comes, 86 gives whole packets of zeros.
source_gives_zeros() { # source_gives_zeros PORT
    cypress "$1" altif:1 dbulk:6,512,16 >/tmp/source || return 1
    cat /tmp/source
    ! grep -qi error /tmp/source
}

sink_takes_data() { # sink_takes_data PORT
    dd if=/dev/zero of=/tmp/data bs=4096 count=16 2>/dev/null
    cypress "$1" altif:1 fbulk:2,/tmp/data,512 >/tmp/sink || return 1
    cat /tmp/sink
    ! grep -qi error /tmp/sink
}

check 'our firmware enumerates at high speed' appears "$ours" 1209:0001 480
check 'our firmware is clean to lsusb -v at high speed' lsusb_is_clean "$ours"
check 'our firmware enumerates at full speed' appears "$ours_slow" 1209:0001 12
check 'our firmware is clean to lsusb -v at full speed' lsusb_is_clean "$ours_slow"
check 'our firmware gives bulk data' source_gives_zeros "$ours"
check 'our firmware takes bulk data' sink_takes_data "$ours"
