#!/usr/bin/env python3
"""Print what an image takes of flash, RAM and stack, and fail beyond the limits.

Flash and RAM limits are those of board/khepera.h. The stack need is the deepest path of the call
graph (frame sizes from GCC's .su files, calls from the disassembly), plus one interrupt of each level
on top. What a call through a pointer may reach is listed in indirect_calls.txt.

Exit codes: 0 fits, 1 does not, 2 wrong use.
"""

import argparse
import fnmatch
import pathlib
import re
import subprocess
import sys

BOARD = pathlib.Path(__file__).parent / "board" / "khepera.h"
INDIRECT_CALLS = pathlib.Path(__file__).parent / "indirect_calls.txt"
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
    """Frame size and source file of every function."""
    sizes, files = {}, {}
    for path in pathlib.Path(folder).rglob("*.su"):
        for line in path.read_text(encoding="utf-8").splitlines():
            place, size, kind = line.split("\t")
            if kind.startswith("dynamic") and "bounded" not in kind:
                raise SystemExit(f"memory use: {place}: frame without a bound")
            name = place.split(":")[-1]
            sizes[name] = max(sizes.get(name, 0), int(size))
            files[name] = pathlib.Path(place.split(":")[0]).name
    return sizes, files


def disassembly(objdump, elf):
    return run(objdump, "-d", "-m", "m68k:cpu32", "-j", ".text", elf).splitlines()


def function_addresses(lines):
    heads = (re.match(r"^([0-9a-f]+) <([^>]+)>:$", line) for line in lines)
    return {int(head.group(1), 16): head.group(2) for head in heads if head}


def call_graph(lines):
    """Calls of each function by name; "*" stands for a call through a pointer, "@" for a function's
    address loaded.

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
                    current |= {functions[int(number)], "@"}
            if match := re.search(r",%(a[0-6])$", line):
                # "lea 1234 <function>,%a4": a call through %a4 is no call through a pointer.
                registers[match.group(1)] = re.search(r"\tlea [0-9a-f]+ <[^>+]+>,", line)
                if registers[match.group(1)]:
                    current.add("@")
            if match := re.search(r"\tj(?:sr|mp) %(\w+)", line):
                if not registers.get(match.group(1)):
                    current.add("*")
    return {name: {one for one in calls if one in "*@" or one in graph} - {name}
            for name, calls in graph.items()}


def resolve_pointers(graph, files):
    """Put the functions that a pointer may reach in the place of each "*"."""
    rules = []
    for line in INDIRECT_CALLS.read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            file, callees = line.split(":")
            rules.append((file, callees.split()))
    for name, calls in graph.items():
        loads_addresses = "@" in calls
        calls.discard("@")
        if "*" not in calls:
            continue
        calls.discard("*")
        file = files.get(name, files.get(name.split(".")[0], ""))
        fitting = [
            callees
            for rule, callees in rules
            if fnmatch.fnmatch(file, rule) or fnmatch.fnmatch(name, rule)
        ]
        reached = {
            one
            for callees in fitting
            for pattern in callees
            for one in fnmatch.filter(graph, pattern)
        }
        if not fitting and not loads_addresses:
            raise SystemExit(f"memory use: {INDIRECT_CALLS.name} does not say what {name} may call")
        calls |= reached


def deepest(name, graph, sizes, path=()):
    """Bytes that a call of `name` takes at most."""
    plain = name.split(".")[0]
    if name in path:
        raise SystemExit(f"memory use: recursion: {' -> '.join((*path, name))}")
    below = max((deepest(one, graph, sizes, (*path, name)) for one in graph.get(name, ())), default=0)
    return sizes.get(name, sizes.get(plain, 0)) + RETURN_ADDRESS + below


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

    sizes, files = frame_sizes(arguments.stack_usage)
    graph = call_graph(disassembly(arguments.objdump, arguments.elf))
    resolve_pointers(graph, files)
    interrupts = [name for name in graph if name.endswith("_isr")]
    isr = max((deepest(name, graph, sizes) for name in interrupts), default=0)
    need = deepest("main", graph, sizes) + INTERRUPT_LEVELS * (isr + EXCEPTION_FRAME)

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
