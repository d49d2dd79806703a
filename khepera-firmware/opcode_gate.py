#!/usr/bin/env python3
"""Refuse an image with machine code that a CPU32 does not execute.

The compiler's own libraries are built for a 68020 with an FPU and link without a warning, and an
emulated 68020 would run them too: only the real chip would stop. So the linked image's code is
disassembled for a CPU32, and anything that cannot be decoded, or that belongs to the larger family
members only (MC68300 family, CPU32 reference manual, section 4.1), is an error.

Exit codes: 0 all code is CPU32 code, 1 some is not, 2 wrong use or no disassembly.
"""

import argparse
import re
import subprocess
import sys

# What objdump may decode although a CPU32 lacks it.
NOT_CPU32 = re.compile(
    r"^(bf(chg|clr|exts|extu|ffo|ins|set|tst)|cas2?[bwl]?|pack|unpk|callm|rtm|cp(?!u)\w*"
    r"|f(?!f)\w+|pflush\w*|pload\w*|pmove\w*|ptest\w*|move16)$"
)
# Memory-indirect addressing, ([bd,An],Xn,od), in objdump's notation: %a0@(12)@(4) .
MEMORY_INDIRECT = re.compile(r"@\([^)]*\)@\(")
LINE = re.compile(r"^\s*([0-9a-f]+):\t((?:[0-9a-f]{4} ?)+)\s*(?:\t(.*))?$")


def offences(disassembly):
    """Yield (address, text, why) for each instruction a CPU32 would not execute."""
    for line in disassembly.splitlines():
        match = LINE.match(line)
        if not match:
            continue
        address, _, text = match.groups()
        text = (text or "").strip()
        if not text:
            continue  # the rest of a long instruction
        mnemonic = text.split()[0]
        if mnemonic in (".short", ".word", ".long", "(bad)"):
            yield address, text, "not an instruction of a CPU32"
        elif NOT_CPU32.match(mnemonic):
            yield address, text, "68020/FPU only"
        elif MEMORY_INDIRECT.search(text):
            yield address, text, "memory-indirect addressing is 68020 only"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--objdump", default="m68k-linux-gnu-objdump")
    parser.add_argument("elf")
    arguments = parser.parse_args()
    command = [arguments.objdump, "-d", "-m", "m68k:cpu32", "-j", ".text", arguments.elf]
    try:
        result = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as error:
        print(f"opcode gate: cannot run {arguments.objdump}: {error}", file=sys.stderr)
        return 2
    if result.returncode != 0:
        print(f"opcode gate: {result.stderr.strip()}", file=sys.stderr)
        return 2
    instructions = sum(1 for line in result.stdout.splitlines() if LINE.match(line))
    if instructions == 0:
        print(f"opcode gate: no code in {arguments.elf}: is it the linked image?", file=sys.stderr)
        return 2
    found = list(offences(result.stdout))
    for address, text, why in found:
        print(f"opcode gate: {address}: {text}: {why}", file=sys.stderr)
    if found:
        return 1
    print(f"opcode gate: {instructions} lines of code, all CPU32")
    return 0


if __name__ == "__main__":
    sys.exit(main())
