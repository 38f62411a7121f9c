"""Compiles a block's C source and runs it on doubles, beside the block's own Python."""

import ctypes
import random
import struct
import subprocess
from ctypes import CFUNCTYPE, POINTER, c_char_p, c_double, c_int, c_uint32, c_void_p

from twip.fmi.blocks import load_block
from twip.fmi.native.block_source import RUNTIME, block_source
from twip.fmi.table import Table

TELL = CFUNCTYPE(None, c_void_p, c_char_p)


class Report(ctypes.Structure):
    _fields_ = [
        ("tell", TELL), ("to", c_void_p), ("prefix", c_char_p), ("at", c_void_p), ("end", c_void_p),
        ("sentence", ctypes.c_char * 600),
    ]  # fmt: skip


class Model(ctypes.Structure):
    _fields_ = [
        ("name", c_char_p), ("exposed", c_uint32), ("size", c_uint32), ("variables", c_void_p), ("places", c_void_p),
        ("inner_step", c_double),
        ("clear", CFUNCTYPE(None, POINTER(c_double))),
        ("initialize", CFUNCTYPE(None, POINTER(c_double), c_double)),
        ("check", CFUNCTYPE(c_int, POINTER(c_double), POINTER(Report))),
        ("step", CFUNCTYPE(c_int, POINTER(c_double), c_double, c_double, c_void_p)),
    ]  # fmt: skip


class NativeBlock:
    """The values of a block twice: as Python attributes and as C doubles."""

    def __init__(self, face, folder, *options):
        self.block = load_block(face)
        self.table = Table(self.block)
        self.text = block_source(self.block)
        source, library = folder / f"{self.block.name}.c", folder / f"{self.block.name}{len(options)}.so"
        source.write_text(self.text, encoding="utf-8")
        command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-Wno-unused-parameter"]
        flags = ["-O2", "-ffp-contract=off", "-fno-builtin", "-fno-math-errno", "-fwrapv", "-fPIC", "-shared", *options]
        subprocess.run([*command, *flags, f"-I{RUNTIME}", str(source), "-o", str(library)], check=True)
        self.model = Model.in_dll(ctypes.CDLL(str(library)), f"{self.block.name}_model")
        assert self.model.size == len(self.table.attributes)
        self.values = (c_double * self.model.size)()
        self.python = self.table.start_values(self.table.slots())
        for i, name in enumerate(self.table.attributes):
            self.values[i] = getattr(self.python, name)

    def set(self, **values):
        for name, value in values.items():
            setattr(self.python, name, value)
            self.values[self.table.attributes.index(name)] = value

    def initialize(self, time=0.0):
        self.table.clear(self.python)
        self.block.initialize(self.python, time)
        self.model.clear(self.values)
        self.model.initialize(self.values, time)

    def step(self, time, size):
        self.block.step(self.python, time, size)
        assert self.model.step(self.values, time, size, None) == 0

    def differing(self):
        """Return attribute → both values where their bits differ."""
        pairs = {n: (float(getattr(self.python, n)), self.values[i]) for i, n in enumerate(self.table.attributes)}
        return {n: p for n, p in pairs.items() if struct.pack("d", p[0]) != struct.pack("d", p[1])}

    def told(self):
        """Return the sentences of the check in C."""
        found = []
        report = Report(TELL(lambda _, text: found.append(text.decode())), None, b"")
        assert self.model.check(self.values, ctypes.byref(report)) == len(found)
        return found


def numbers(count, seed=1):
    """Return special doubles, doubles of all magnitudes, and round ones, with both signs."""
    special = (0.0, 1.0, 0.5, 1.5, 2.5, 5e-324, 2.2250738585072014e-308, 1e-300, 1e300, 2.0**52, 2.0**52 + 1, 2.0**53,
               0.49999999999999994, 1e15, 1e16, 9999999999.5, 99999999995.0, 123456789.5, 1e-5, 1e-4)  # fmt: skip
    random_numbers = random.Random(seed)
    found = [sign * x for x in special for sign in (1.0, -1.0)]
    while len(found) < count:
        x = struct.unpack("d", random_numbers.randbytes(8))[0]
        if x - x == 0.0:
            found.append(x)
        found.append(round(random_numbers.uniform(-1e3, 1e3), random_numbers.randint(0, 6)))
    return found
