"""The opcode gate of the 68331's image: what it must refuse, and what it must let pass."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

GATE = pathlib.Path(__file__).resolve().parents[2] / "khepera-firmware" / "opcode_gate.py"
PREFIX = "m68k-linux-gnu-"


class OpcodeGate(unittest.TestCase):
    def gate(self, assembly):
        """Link `assembly` into an image; returns the gate's (exit code, stderr)."""
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "code.s"
            image = pathlib.Path(folder) / "code.elf"
            source.write_text(f".text\n.global _start\n_start:\n{assembly}\nrts\n")
            command = [f"{PREFIX}gcc", "-m68020", "-m68881", "-nostdlib", "-static", "-o"]
            subprocess.run([*command, image, source], check=True, capture_output=True)
            command = [sys.executable, GATE, "--objdump", f"{PREFIX}objdump", image]
            result = subprocess.run(command, capture_output=True, text=True, check=False)
            return result.returncode, result.stderr

    def test_code_of_a_cpu32_passes(self):
        self.assertEqual(self.gate("muls.l %d0,%d1:%d2\nmove.l (4,%a0,%d1.l*4),%d0")[0], 0)

    def test_each_planted_stranger_is_refused(self):
        for stranger in (
            "bfffo %d0{#0:#32},%d1",
            "bfextu (%a0){#3:#5},%d0",
            "cas.l %d0,%d1,(%a0)",
            "pack %d0,%d1,#0",
            "fmove.l %d0,%fp0",
            "move.l ([4,%a0],%d1.l,8),%d0",
            "callm #0,(%a0)",
            ".short 0xf280, 0x0000",
        ):
            with self.subTest(stranger):
                code, errors = self.gate(f"moveq #1,%d0\n{stranger}\nmoveq #2,%d0")
                self.assertEqual(code, 1, errors)
                self.assertIn("opcode gate:", errors)

    def test_a_file_that_is_no_image_is_an_error_of_its_own(self):
        command = [sys.executable, GATE, "--objdump", f"{PREFIX}objdump", __file__]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 2)
        self.assertIn("opcode gate:", result.stderr)


if __name__ == "__main__":
    unittest.main()
