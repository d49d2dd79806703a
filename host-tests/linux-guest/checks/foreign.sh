# Firmware that others wrote, with the drivers and tools it was written for.
#
# device: analyser $sot twin fx2 --ram 16k
# device: serial $sot twin fx2 $root/lib/firmware/opsis-fx2/usb-uart.ihx --ram 16k --serial loop
# bring: $root/usr/share/sigrok-firmware/fx2lafw-sigrok-fx2-8ch.fw

# fx2lafw's requests: B0 version, B1 start (flags, then clocks between samples - 1), B2 revision.
analyser_answers() {
    appears "$analyser" 1d50:608c 480 && is "$(attribute "$analyser" serial)" 'sigrok FX2 8ch' &&
        is "$(vendor_in "$analyser" 0xB0 0 0 2 | cut -c 1-2)" 01 && is "$(vendor_in "$analyser" 0xB2 0 0 1)" 01
}

# 19.5 kHz, the slowest: the firmware ends a capture that nobody reads in time. The reader comes first. All
# pins of the empty board are high.
analyser_samples() {
    local reader
    cypress "$analyser" altif:0 dbulk:2,512,16 >/tmp/samples 2>&1 &
    reader=$!
    usleep 300000
    vendor_out "$analyser" 0xB1 0 0 0005ff || return 1
    wait $reader
    grep -i error /tmp/samples && return 1
    is "$(grep -cE '0x[0-9a-f]{4}( f{16}){4} ' /tmp/samples)" $((16 * 512 / 32))
}

load_raw() { # load_raw PORT IMAGE: through request A0, as sigrok does it
    local at=0 size
    appears "$1" 04b4:8613 480 || return 1
    size=$(stat -c %s "$2")
    vendor_out "$1" 0xA0 0xE600 0 01 || return 1
    while [ $at -lt "$size" ]; do
        vendor_out "$1" 0xA0 $at 0 "$(tail -c +$((at + 1)) "$2" | head -c 2048 | hexdump -v -e '/1 "%02x"')" ||
            return 1
        at=$((at + 2048))
    done
    vendor_out "$1" 0xA0 0xE600 0 00
}

serial_port_echoes() {
    local left=$patience
    until [ -c /dev/ttyACM0 ]; do
        left=$((left - 1))
        [ $left -gt 0 ] || return 1
        usleep 100000
    done
    stty -F /dev/ttyACM0 115200 raw -echo
    (read -r line </dev/ttyACM0 && echo "$line" >/tmp/echo) &
    usleep 200000
    echo 'there and back' >/dev/ttyACM0
    usleep 500000
    is "$(cat /tmp/echo)" 'there and back'
}

insmod /modules/cdc-acm.ko
check "sigrok's image goes in by request A0" load_raw "$analyser" /files/fx2lafw-sigrok-fx2-8ch.fw
check "sigrok's logic analyser answers" analyser_answers
check "sigrok's logic analyser samples" analyser_samples
check "the Opsis board's image is a serial port of the kernel" appears "$serial" 2a19:5441 480
check "the Opsis board's serial port passes lines both ways" serial_port_echoes
