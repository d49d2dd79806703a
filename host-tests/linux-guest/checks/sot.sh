# `sot` itself on a real kernel's USB, at a whole turret: what `sot twin robot` is to it elsewhere.
#
# device: robot $sot twin robot
# device: empty $sot twin fx2
# program: $sot
# bring: $firmware

sot_robot() { # sot_robot VERB...: at the turret, named by its serial number
    sot "$@" --robot "usb:$(attribute "$robot" serial)"
}

sot_says() { # sot_says WORDS VERB...
    local words=$1
    shift
    sot_robot "$@" >/tmp/sot || { cat /tmp/sot; return 1; }
    cat /tmp/sot
    grep -q "$words" /tmp/sot
}

sot_asks_which() {
    sot info 2>/tmp/sot && return 1
    is $? 2 || { cat /tmp/sot; return 1; }
    grep -q -- --robot /tmp/sot
}

slot_reads_back() {
    sot_robot fpga verify 5 /tmp/capture.bin && sot_robot fpga read 5 -o /tmp/back.bin &&
        cmp /tmp/back.bin /tmp/capture.bin
}

blank_runs_ours() {
    sot flash fx2 /files/fx2-firmware.ihx --robot "usb:@1-$empty" && appears "$empty" 1209:0001 480
}

sot bitstream make capture -o /tmp/capture.bin 2>/dev/null
sot bitstream make soccer --partial -o /tmp/change.bin 2>/dev/null

check 'the turret of a whole robot enumerates' appears "$robot" 1209:0001 480
check 'the turret of a whole robot is clean to lsusb -v' lsusb_is_clean "$robot"
check 'sot lists it' sh -c "sot list | grep '^usb:TWIN'"
check 'sot configures the FPGA' sot_says 'from USB, 234456 bytes' flash fpga /tmp/capture.bin
check 'sot reconfigures it in part' sot_says 'in part' flash fpga /tmp/change.bin
check 'sot writes a slot' sot_says 'written' flash fpga /tmp/capture.bin --slot 5
check 'sot leaves it alone the second time' sot_says 'unchanged' flash fpga /tmp/capture.bin --slot 5
check 'sot reads it back' slot_reads_back
check 'sot boots it' sot_says 'from slot 5' fpga boot 5
check 'sot loads firmware into a blank chip and waits for it' blank_runs_ours
check 'sot asks which of several robots' sot_asks_which
