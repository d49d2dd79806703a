#!/usr/bin/env python3
"""Fill in the header of the program in a linked khepera-firmware.elf (common/link/base_image.h).

The program's bytes are taken from the file as it will lie in the flash; length, check sum, addresses
and build id go into the section .image_header, with the commit word: the image of a new base.

Exit codes: 0 done, 1 the file is not as expected, 2 wrong use.
"""

import argparse
import binascii
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import zlib

TOP = pathlib.Path(__file__).parent.parent
HEADER = TOP / "common" / "link" / "base_image.h"
PROGRAM = (".vectors", ".text", ".rodata", ".note.gnu.build-id", ".data")
GENERATION = 1
SECTION_SIZE = 256


def number(name):
    match = re.search(rf"#define\s+{name}\s+(\w+)", HEADER.read_text(encoding="utf-8"))
    if not match:
        raise SystemExit(f"image header: {HEADER} does not define {name}")
    return int(match.group(1).rstrip("ul"), 0)


def run(*command):
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise SystemExit(f"image header: {' '.join(map(str, command))}: {result.stderr.strip()}")
    return result.stdout


def address_of(nm, elf, symbol):
    for line in run(nm, elf).splitlines():
        value, _, name = line.partition(" ")
        if name.split()[-1] == symbol:
            return int(value, 16)
    raise SystemExit(f"image header: {elf} has no symbol {symbol}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--objcopy", default="m68k-linux-gnu-objcopy")
    parser.add_argument("--nm", default="m68k-linux-gnu-nm")
    parser.add_argument("elf")
    arguments = parser.parse_args()

    with tempfile.TemporaryDirectory() as folder:
        binary = pathlib.Path(folder) / "program.bin"
        note = pathlib.Path(folder) / "note.bin"
        only = [option for name in PROGRAM for option in ("-j", name)]
        run(arguments.objcopy, "-O", "binary", *only, arguments.elf, binary)
        run(arguments.objcopy, "-O", "binary", "-j", ".note.gnu.build-id", arguments.elf, note)
        program = binary.read_bytes()
        build = note.read_bytes().rstrip(b"\0")[16:36].ljust(20, b"\0")

        header = struct.pack(
            ">IB3xIIIII20s14x",
            number("BASE_IMAGE_MAGIC"),
            number("BASE_IMAGE_VERSION"),
            len(program),
            address_of(arguments.nm, arguments.elf, "program_start"),
            address_of(arguments.nm, arguments.elf, "program_entry"),
            zlib.crc32(program),
            GENERATION,
            build,
        )
        header += struct.pack(">H", binascii.crc_hqx(header, 0xFFFF))
        header += struct.pack(">I", number("BASE_IMAGE_COMMIT_WORD"))
        filled = pathlib.Path(folder) / "header.bin"
        filled.write_bytes(header.ljust(SECTION_SIZE, b"\xff"))
        run(arguments.objcopy, "--update-section", f".image_header={filled}", arguments.elf)
    print(f"image: {len(program)} bytes, CRC-32 {zlib.crc32(program):08x}, build {build[:4].hex()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
