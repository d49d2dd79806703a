# What the checks have in common: sourced by the guest's busybox shell. A device is named by its port on
# the USB controller.

# Tenths of a second until a device must have appeared.
readonly patience=150

check() { # check NAME COMMAND...
    local name=$1
    shift
    if "$@" >/tmp/out 2>&1; then
        echo "ok $name"
    else
        echo "FAILED $name"
        head -n 60 /tmp/out
    fi
}

attribute() { # attribute PORT NAME
    cat "/sys/bus/usb/devices/1-$1/$2" 2>/dev/null
}

identity() { # identity PORT
    echo "$(attribute "$1" idVendor):$(attribute "$1" idProduct)"
}

node() { # node PORT: the device file
    printf '/dev/bus/usb/%03d/%03d\n' "$(attribute "$1" busnum)" "$(attribute "$1" devnum)"
}

place() { # place PORT: bus and device number
    printf '%03d:%03d\n' "$(attribute "$1" busnum)" "$(attribute "$1" devnum)"
}

appears() { # appears PORT VENDOR:PRODUCT MBIT_PER_S
    local left=$patience
    while [ "$(identity "$1")" != "$2" ] || [ -z "$(attribute "$1" bNumInterfaces)" ]; do
        left=$((left - 1))
        [ $left -gt 0 ] || {
            echo "on port $1 is $(identity "$1"), not $2"
            return 1
        }
        usleep 100000
    done
    is "$(attribute "$1" speed)" "$3"
}

is() { # is FOUND EXPECTED
    [ "$1" = "$2" ] || {
        echo "found '$1', expected '$2'"
        return 1
    }
}

# Alternate settings and endpoints, one a line, as lsusb understands them.
settings() { # settings PORT
    lsusb -v -s "$(place "$1")" 2>/dev/null | awk '
        /bAlternateSetting/ { print "alternate", $2 }
        /bEndpointAddress/ { address = $2 }
        /Transfer Type/ { kind = $3 }
        /wMaxPacketSize/ { print " ", address, kind, $4 * 1 }'
}

settings_are() { # settings_are PORT FILE
    settings "$1" >/tmp/settings
    diff "$2" /tmp/settings
}

# lsusb complains on both its outputs.
lsusb_is_clean() { # lsusb_is_clean PORT
    lsusb -v -s "$(place "$1")" >/tmp/lsusb 2>/tmp/lsusb.errors || echo "exit code $?"
    cat /tmp/lsusb.errors /tmp/lsusb
    grep -q bNumConfigurations /tmp/lsusb && [ ! -s /tmp/lsusb.errors ] || return 1
    ! grep -iE 'unrecognized|invalid|warning|junk|unavailable|\(error\)' /tmp/lsusb
}

cypress() { # cypress PORT COMMAND...: cycfx2prog on that device
    local port=$1
    shift
    cycfx2prog "-d=$(place "$port" | tr : .)" "$@"
}

# Complaints that are others' affair: one foreign image names packets of 64 bytes at high speed, another an
# interval that USB does not have; libfx2's loader leaves the bus in the middle of request 168.
kernel_is_content() {
    ! dmesg | grep -E 'usb 1-' | grep -vE 'has invalid maxpacket 64|invalid bInterval 64|cmd control_client rqt 64 rq 168 ' |
        grep -iE 'error|fail|unable|not responding|not accepting|invalid|reset'
}

vendor_in() { # vendor_in PORT REQUEST VALUE INDEX LENGTH: a vendor request to the device, in hex
    local port=$1
    shift
    control_client "$(node "$port")" in 0x40 "$@"
}

vendor_out() { # vendor_out PORT REQUEST VALUE INDEX [HEX]
    local port=$1
    shift
    control_client "$(node "$port")" out 0x40 "$@"
}

# Loads a program into a chip that runs none.
load_with_fxload() { # load_with_fxload PORT IMAGE
    fxload -t fx2 -D "$(node "$1")" -I "$2"
}
