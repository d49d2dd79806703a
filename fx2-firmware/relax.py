#!/usr/bin/env python3
"""Link the FX2's image with short calls and jumps.

sdcc calls everything by lcall and ljmp, three bytes each; its linker does not relax. Where caller and
callee share a page of 2 KB, acall and ajmp do it in two. This links once, sees from the listings
where everything has come to lie, rewrites what can be short in the compiler's assembly, assembles and
links again, until nothing changes. A call that once had to become long again stays long, so that this
ends.

usage: relax.py OUTPUT.ihx OBJECT.rel... -- LINK COMMAND WITHOUT OBJECTS...
"""
import re
import shutil
import subprocess
import sys
from pathlib import Path

PAGE = 2048
ROUNDS_MAX = 20
SHORT = {"lcall": "acall", "ljmp": "ajmp"}
CALL = re.compile(r"^\t(lcall|ljmp)\t(_\w+)$")
AREA = re.compile(r"^\t\.area\s+(\w+)")
# In a relocated listing: address, bytes, cycles, number of the assembly's line, the line itself.
LISTED = re.compile(r"^\s+([0-9A-F]{6})(?: [0-9A-F]{2})* +(?:\[\s*\d+\])?\s+(\d+) (.*)$")
LABEL = re.compile(r"^(\w+)::?$")


class Module:
    """One assembly file and where its lines have come to lie."""

    def __init__(self, assembly: Path, folder: Path):
        self.lines = assembly.read_text().splitlines()
        self.path = folder / (str(assembly).replace("/", "_").removesuffix(".asm") + ".asm")
        self.calls = self.find_calls()
        self.address: dict[int, int] = {}
        self.labels: dict[str, int] = {}

    def find_calls(self) -> dict[int, re.Match]:
        """Outside the program proper the jumps have fixed places: the vectors."""
        calls, area = {}, ""
        for n, line in enumerate(self.lines):
            if m := AREA.match(line):
                area = m[1]
            elif area == "CSEG" and (m := CALL.match(line)):
                calls[n] = m
        return calls

    def assemble(self, short: set[int]) -> None:
        lines = list(self.lines)
        for n in short:
            operation, target = self.calls[n].groups()
            lines[n] = f"\t{SHORT[operation]}\t{target}"
        self.path.write_text("\n".join(lines) + "\n")
        run(["sdas8051", "-plosgffw", str(self.path.with_suffix(".rel")), str(self.path)])

    def read_listing(self) -> None:
        self.address, self.labels = {}, {}
        for line in self.path.with_suffix(".rst").read_text(errors="replace").splitlines():
            if m := LISTED.match(line):
                address, number = int(m[1], 16), int(m[2]) - 1
                self.address[number] = address
                if label := LABEL.match(m[3]):
                    self.labels[label[1]] = address


def run(command: list[str], forgive: str = "") -> None:
    """Stop if the command fails, unless it complains of nothing but `forgive`."""
    done = subprocess.run(command, capture_output=True, text=True)
    complaints = re.findall(r"^\?.*", done.stdout + done.stderr, re.MULTILINE)
    if forgive and complaints and all(forgive in line for line in complaints):
        return
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")


def in_reach(modules: list[Module]) -> list[set[int]]:
    """For each module the lines whose calls may be short as everything lies now."""
    everywhere: dict[str, int] = {}
    for module in modules:
        everywhere |= module.labels
    reachable = []
    for module in modules:
        near = set()
        for n, call in module.calls.items():
            target = module.labels.get(call[2], everywhere.get(call[2]))
            after = module.address[n] + 2
            if target is not None and target // PAGE == after // PAGE:
                near.add(n)
        reachable.append(near)
    return reachable


def link(modules: list[Module], output: Path, command: list[str], forgive: str = "") -> None:
    objects = (str(module.path.with_suffix(".rel")) for module in modules)
    run([*command, *objects, "-o", str(output)], forgive)
    for module in modules:
        module.read_listing()


def main() -> None:
    split = sys.argv.index("--")
    output, objects, command = Path(sys.argv[1]), sys.argv[2:split], sys.argv[split + 1 :]
    folder = output.parent / f"{output.stem}-relaxed"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    modules = [Module(Path(name).with_suffix(".asm"), folder) for name in objects]
    # The first layout may exceed the memory: it is not the one that counts.
    generous = [*command, "--code-size", "65536"]
    short: list[set[int]] = [set() for _ in modules]
    banned: list[set[int]] = [set() for _ in modules]
    for _ in range(ROUNDS_MAX):
        for module, lines in zip(modules, short):
            module.assemble(lines)
        link(modules, output, generous, forgive="2K Page relocation error")
        near = in_reach(modules)
        for lines, reach, never in zip(short, near, banned):
            never |= lines - reach
        wanted = [reach - never for reach, never in zip(near, banned)]
        if wanted == short:
            break
        short = wanted
    else:
        sys.exit(f"no stable layout after {ROUNDS_MAX} rounds")
    link(modules, output, command)
    print(f"short calls and jumps: {sum(map(len, short))} of {sum(len(m.calls) for m in modules)}")


main()
