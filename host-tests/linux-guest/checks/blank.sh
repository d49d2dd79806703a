# Blank chips, and a foreign image loaded into them with both loaders that Debian has.
#
# device: blank $sot twin fx2
# device: blank2 $sot twin fx2
# bring: $root/lib/firmware/ixo-usb-jtag/usbjtag-basic.hex
# bring: host-tests/linux-guest/expected/blank
readonly ixo=/files/usbjtag-basic.hex

ram_holds_what_was_written() { # ram_holds_what_was_written PORT
    cypress "$1" reset set:0x0123,0x5a set:0x1fff,0xc3 dram:0x0123,1 dram:0x1fff,1 >/tmp/ram || return 1
    cat /tmp/ram
    grep -qi '5a' /tmp/ram && grep -qi 'c3' /tmp/ram
}

is_ixo() { # is_ixo PORT
    appears "$1" 16c0:06ad 480 && is "$(attribute "$1" manufacturer)" ixo.de &&
        is "$(attribute "$1" product)" USB-JTAG-IF
}

check 'a blank chip appears at high speed' appears "$blank" 04b4:8613 480
check 'another one does' appears "$blank2" 04b4:8613 480
check 'the blank chip has the default interfaces' settings_are "$blank" /files/blank
check 'the blank chip is clean to lsusb -v' lsusb_is_clean "$blank"
check 'cycfx2prog reads back the RAM that it wrote' ram_holds_what_was_written "$blank2"
check 'fxload loads ixo-usb-jtag' load_with_fxload "$blank" $ixo
check 'ixo-usb-jtag comes back as itself' is_ixo "$blank"
check 'ixo-usb-jtag is clean to lsusb -v' lsusb_is_clean "$blank"
check 'cycfx2prog loads ixo-usb-jtag' cypress "$blank2" "prg:$ixo" run
check 'ixo-usb-jtag comes back there too' is_ixo "$blank2"
