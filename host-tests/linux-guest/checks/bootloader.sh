# libfx2's Cypress-class boot loader, loaded into chips with a boot EEPROM of either address size: what
# its client fx2tool asks for.
#
# before: : >"$work/large.iic"
# before: printf '\xc0\xb4\x04\x13\x86\x34\x12\x00' >"$work/small.iic"
# device: large $sot twin fx2 --eeprom $work/large.iic
# device: small $sot twin fx2 --eeprom $work/small.iic
# bring: $files/fx2/boot-cypress.ihex
# afterwards: 'the twin keeps what was written into the large EEPROM' file_holds "$work/large.iic" 256 c2b404138600000000010203
# afterwards: 'the twin keeps what was written into the small EEPROM' file_holds "$work/small.iic" 32 5566778899aa
readonly loader=/files/boot-cypress.ihex
readonly read_write_ram=0xA3 renumerate=0xA8 page_size=0xB0
readonly one_address_byte=0xA2 two_address_bytes=0xA9

is_named() { # is_named PORT BCD_DEVICE
    appears "$1" 04b4:8613 480 && is "$(attribute "$1" bcdDevice)" "$2"
}

answers() { # answers HEX PORT REQUEST VALUE LENGTH
    is "$(vendor_in "$2" "$3" "$4" 0 "$5")" "$1"
}

# Pages of 2^LOG2 bytes; writes and reads back across their borders.
eeprom_takes() { # eeprom_takes PORT REQUEST LOG2 ADDRESS HEX
    vendor_out "$1" $page_size "$3" 0 && vendor_out "$1" "$2" "$4" 0 "$5" &&
        answers "$5" "$1" "$2" "$4" $((${#5} / 2))
}

# The loader leaves the bus without a word: the request fails, as fx2tool expects.
comes_back_as_itself() { # comes_back_as_itself PORT
    local before left=$patience
    before=$(attribute "$1" devnum)
    vendor_out "$1" $renumerate 0 0
    while [ "$(attribute "$1" devnum)" = "$before" ] || [ -z "$(attribute "$1" bNumInterfaces)" ]; do
        left=$((left - 1))
        [ $left -gt 0 ] || return 1
        usleep 100000
    done
    is "$(identity "$1"), $(attribute "$1" speed), $(attribute "$1" product)" \
        '04b4:8613, 480, FX2 series Cypress-class bootloader'
}

check 'a blank EEPROM leaves the chip blank' appears "$large" 04b4:8613 480
check 'a C0 EEPROM names the device' is_named "$small" 1234
check 'fxload loads boot-cypress' load_with_fxload "$large" $loader
check 'cycfx2prog loads boot-cypress' cypress "$small" "prg:$loader" run
check 'A9 writes and reads the large EEPROM' eeprom_takes "$large" $two_address_bytes 6 256 \
    c2b404138600000000010203
check 'A9 crosses pages' eeprom_takes "$large" $two_address_bytes 5 0x3fe8 \
    000102030405060708090a0b0c0d0e0f1011121314151617
check 'A9 reads a blank EEPROM' answers ffffffff "$large" $two_address_bytes 0 4
check 'A2 writes and reads the small EEPROM' eeprom_takes "$small" $one_address_byte 3 32 5566778899aa
check 'A2 reads the identity' answers c0b4041386341200 "$small" $one_address_byte 0 8
check 'A3 writes RAM' vendor_out "$large" $read_write_ram 0xE100 0 0badcafe
check 'A3 reads RAM' answers 0badcafe "$large" $read_write_ram 0xE100 4
check 'A0 reads RAM while the program runs' answers 0badcafe "$large" 0xA0 0xE100 4
check 'A8 renumerates' comes_back_as_itself "$large"
check 'boot-cypress is clean to lsusb -v' lsusb_is_clean "$large"
