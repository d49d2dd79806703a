#!/usr/bin/env python3
"""Print what an image takes of flash, RAM and stack, and fail beyond the limits.

Flash and RAM limits are those of board/khepera.h. The stack need is the deepest path of the call
graph (frame sizes from GCC's .su files, calls from the disassembly), plus one interrupt of each level on top. A call through a pointer counts
as the deepest function whose address is taken; below such a function, as the deepest one that itself
calls nothing through a pointer: commands call the base, the base calls nobody.

Exit codes: 0 fits, 1 does not, 2 wrong use.
"""

import argparse
import pathlib
import re
import subprocess
import sys

BOARD = pathlib.Path(__file__).parent / "board" / "khepera.h"
# The CPU stacks four words; movem of D0/D1/A0/A1 and more is in the frame size of the .su files.
EXCEPTION_FRAME = 8
RETURN_ADDRESS = 4
INTERRUPT_LEVELS = 4


def board_number(name):
    match = re.search(rf"#define\s+{name}\s+(0x[0-9A-Fa-f]+)", BOARD.read_text(encoding="utf-8"))
    if not match:
        raise SystemExit(f"memory use: {BOARD} does not define {name}")
    return int(match.group(1), 16)


def run(*command):
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise SystemExit(f"memory use: {' '.join(command)}: {result.stderr.strip()}")
    return result.stdout


def sections(objdump, elf):
    """(name, size, address, load address, flags) of every section that takes memory."""
    found = []
    lines = run(objdump, "-h", elf).splitlines()
    for line, flags in zip(lines, lines[1:]):
        match = re.match(r"\s*\d+ (\S+)\s+(\w{8})\s+(\w{8})\s+(\w{8})", line)
        if match and "ALLOC" in flags:
            name, *numbers = match.groups()
            size, address, load = (int(number, 16) for number in numbers)
            found.append((name, size, address, load, "LOAD" in flags))
    return found


def frame_sizes(folder):
    sizes = {}
    for path in pathlib.Path(folder).rglob("*.su"):
        for line in path.read_text(encoding="utf-8").splitlines():
            place, size, kind = line.split("\t")
            if kind.startswith("dynamic") and "bounded" not in kind:
                raise SystemExit(f"memory use: {place}: frame without a bound")
            name = place.split(":")[-1]
            sizes[name] = max(sizes.get(name, 0), int(size))
    return sizes


def disassembly(objdump, elf):
    return run(objdump, "-d", "-m", "m68k:cpu32", "-j", ".text", elf).splitlines()


def function_addresses(lines):
    heads = (re.match(r"^([0-9a-f]+) <([^>]+)>:$", line) for line in lines)
    return {int(head.group(1), 16): head.group(2) for head in heads if head}


def call_graph(lines):
    """Calls of each function by name; "*" stands for a call through a pointer.

    A function whose address is merely loaded counts as called: GCC keeps the addresses of what it
    calls often in registers."""
    functions = function_addresses(lines)
    graph, current, registers = {}, None, {}
    for line in lines:
        if match := re.match(r"^[0-9a-f]+ <([^>]+)>:$", line):
            current, registers = graph.setdefault(match.group(1), set()), {}
        elif current is not None:
            current.update(re.findall(r"<([^>+]+)>", line))
            for number in re.findall(r"move(?:a)?l #(\d+),", line):
                if int(number) in functions:
                    current.add(functions[int(number)])
            if match := re.search(r",%(a[0-6])$", line):
                # "lea 1234 <function>,%a4": a call through %a4 is no call through a pointer.
                registers[match.group(1)] = re.search(r"\tlea [0-9a-f]+ <[^>+]+>,", line)
            if match := re.search(r"\tj(?:sr|mp) %(\w+)", line):
                if not registers.get(match.group(1)):
                    current.add("*")
    return {name: {one for one in calls if one == "*" or one in graph} - {name}
            for name, calls in graph.items()}


def calls_pointers(name, graph, seen=frozenset()):
    """Whether `name` or anything below it calls through a pointer."""
    callees = graph.get(name, set())
    return "*" in callees or any(
        calls_pointers(one, graph, seen | {name}) for one in callees - seen - {name}
    )


def deepest(name, graph, sizes, pointed, path=()):
    """Bytes that a call of `name` takes at most; `pointed`: what a pointer may call."""
    plain = name.split(".")[0]
    if name in path:
        raise SystemExit(f"memory use: recursion: {' -> '.join((*path, name))}")
    below = 0
    for callee in graph.get(name, ()):
        if callee == "*":
            leaves = {one for one in pointed if not calls_pointers(one, graph)}
            for one in pointed:
                below = max(below, deepest(one, graph, sizes, leaves, (*path, name)))
        else:
            below = max(below, deepest(callee, graph, sizes, pointed, (*path, name)))
    return sizes.get(name, sizes.get(plain, 0)) + RETURN_ADDRESS + below


def pointed_functions(objdump, elf, addresses):
    """Functions whose address lies in the linked image's data."""
    found = set()
    for section in (".rodata", ".data"):
        data = b""
        for line in run(objdump, "-s", "-j", section, elf).splitlines():
            if match := re.match(r"^ [0-9a-f]+ ((?:[0-9a-f]{2,8} ?)+) ", line):
                data += bytes.fromhex(match.group(1))
        for at in range(0, len(data) - 3, 2):  # the 68k aligns to two bytes
            found.add(addresses.get(int.from_bytes(data[at : at + 4], "big")))
    return found - {None}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--objdump", default="m68k-linux-gnu-objdump")
    parser.add_argument("--nm", default="m68k-linux-gnu-nm")
    parser.add_argument("--stack-usage", required=True, help="folder with GCC's .su files")
    parser.add_argument("--loader", action="store_true", help="the image is the resident loader")
    parser.add_argument("elf")
    arguments = parser.parse_args()

    place = ("BOARD_FLASH_BASE", "BOARD_LOADER_SIZE") if arguments.loader else (
        "BOARD_IMAGE_A", "BOARD_IMAGE_BANK_SIZE")
    flash_base, flash_limit = board_number(place[0]), board_number(place[1])
    ram_base, ram_limit = board_number("BOARD_RAM_BASE"), board_number("BOARD_RAM_SIZE")
    flash = ram = stack = 0
    failures = []
    for name, size, address, load, loaded in sections(arguments.objdump, arguments.elf):
        if name == ".loader":
            continue  # has been judged when it was linked
        if loaded:
            flash += size
            if not flash_base <= load <= load + size <= flash_base + flash_limit:
                failures.append(f"{name} lies outside the flash")
        if address >= ram_base:
            ram += size
            if address + size > ram_base + ram_limit:
                failures.append(f"{name} lies outside the RAM")
        elif not flash_base <= address <= address + size <= flash_base + flash_limit:
            failures.append(f"{name} lies in no memory")
        if name == ".stack":
            stack = size
        if name == ".bss" and arguments.loader:
            stack = ram_base + ram_limit - (address + size)

    sizes = frame_sizes(arguments.stack_usage)
    code = disassembly(arguments.objdump, arguments.elf)
    graph = call_graph(code)
    pointed = pointed_functions(arguments.objdump, arguments.elf, function_addresses(code))
    interrupts = [name for name in graph if name.endswith("_isr")]
    isr = max((deepest(name, graph, sizes, pointed) for name in interrupts), default=0)
    need = deepest("main", graph, sizes, pointed) + INTERRUPT_LEVELS * (isr + EXCEPTION_FRAME)

    for what, used, limit in (
        ("flash", flash, flash_limit),
        ("RAM", ram, ram_limit),
        ("stack", need, stack),
    ):
        print(f"{what:5} {used:7} of {limit} bytes, {100 * used / limit:.1f} %")
        if used > limit:
            failures.append(f"{what}: {used} bytes are more than {limit}")
    for failure in failures:
        print(f"memory use: {failure}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
