"""A bare FMI 2.0 co-simulation host: standard library only, so that it can run FMUs where nothing is installed.

As a script it is the clean process of the tests: `python -I -S fmi_host.py FMU FOLDER COMMAND …`, where the import of
anything but the standard library and the FMU's own modules is refused.
"""

import ctypes
import importlib.abc
import json
import struct
import sys
import zipfile
from ctypes import CFUNCTYPE, byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path
from xml.etree import ElementTree

OK, WARNING, DISCARD, ERROR, FATAL = range(5)

LOGGER = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
ALLOCATE = CFUNCTYPE(c_void_p, c_size_t, c_size_t)
FREE = CFUNCTYPE(None, c_void_p)
FINISHED = CFUNCTYPE(None, c_void_p, c_int)
LIBRARY = ctypes.CDLL(None)
C_TYPES = {"Real": c_double, "Integer": c_int, "Boolean": c_int}


class Callbacks(ctypes.Structure):
    _fields_ = [
        ("logger", LOGGER),
        ("allocate", ALLOCATE),
        ("free", FREE),
        ("finished", FINISHED),
        ("environment", c_void_p),
    ]


class Fmu:
    """An FMU unpacked to a folder, its description read and its library loaded."""

    def __init__(self, path, folder):
        self.folder = Path(folder)
        with zipfile.ZipFile(path) as archive:
            archive.extractall(self.folder)
        root = ElementTree.parse(self.folder / "modelDescription.xml").getroot()
        self.name, self.guid = root.get("modelName"), root.get("guid")
        self.variables = {v.get("name"): v for v in root.find("ModelVariables")}
        self.references = {n: int(v.get("valueReference")) for n, v in self.variables.items()}
        self.types = {n: v[0].tag for n, v in self.variables.items()}
        self.step_size = float(root.find("DefaultExperiment").get("stepSize"))
        self.library = ctypes.CDLL(str(self.folder / "binaries" / "linux64" / f"{self.name}.so"))
        self.library.fmi2Instantiate.restype = c_void_p
        self.library.fmi2Instantiate.argtypes = [c_char_p, c_int, c_char_p, c_char_p, c_void_p, c_int, c_int]

    def of(self, causality):
        return [n for n, v in self.variables.items() if v.get("causality") == causality]


class Instance:
    """One instance; every FMI status is returned or, by `check`, required to be OK."""

    def __init__(self, fmu, name="instance", logging=True):
        self.fmu = fmu
        self.records = []
        self.callbacks = Callbacks(
            LOGGER(lambda _, __, status, category, message: self.records.append((status, category, message))),
            ALLOCATE(ctypes.cast(LIBRARY.calloc, c_void_p).value),
            FREE(ctypes.cast(LIBRARY.free, c_void_p).value),
            FINISHED(lambda _, __: None),
            None,
        )
        resources = (fmu.folder / "resources").as_uri().encode()
        self.handle = fmu.library.fmi2Instantiate(
            name.encode(), 1, fmu.guid.encode(), resources, byref(self.callbacks), 0, int(logging)
        )
        assert self.handle
        self.component = c_void_p(self.handle)

    @property
    def log(self):
        """Messages as (status, category, text); the text is read as the C format that it is."""
        return [(s, c.decode(), m.decode() % ()) for s, c, m in self.records]

    def call(self, function, *arguments):
        return getattr(self.fmu.library, f"fmi2{function}")(self.component, *arguments)

    def check(self, function, *arguments):
        status = self.call(function, *arguments)
        assert status == OK, (function, status, self.log)

    def begin(self, start=0.0, **values):
        """Set values (dots as double underscores), enter and leave initialization mode."""
        self.enter(start)
        self.set(**values)
        self.check("ExitInitializationMode")
        return self

    def enter(self, start=0.0):
        self.check("SetupExperiment", c_int(0), c_double(0.0), c_double(start), c_int(0), c_double(0.0))
        self.check("EnterInitializationMode")

    def set(self, **values):
        for name, value in values.items():
            name = name.replace("__", ".")
            kind = self.fmu.types[name]
            reference, argument = c_uint(self.fmu.references[name]), C_TYPES[kind](value)
            self.check(f"Set{kind}", byref(reference), c_size_t(1), byref(argument))

    def get(self, *names):
        values = []
        for name in names:
            kind = self.fmu.types[name]
            reference, result = c_uint(self.fmu.references[name]), C_TYPES[kind]()
            self.check(f"Get{kind}", byref(reference), c_size_t(1), byref(result))
            values.append(result.value)
        return values[0] if len(names) == 1 else values

    def all(self):
        """The bits of every variable."""
        return [struct.pack("d", x).hex() for x in self.get(*self.fmu.variables)]

    def step(self, time, size):
        return self.call("DoStep", c_double(time), c_double(size), c_int(1))

    def run(self, first, steps, excite=True):
        """Do steps number `first` and on, with inputs that move; return the bits of all variables after each."""
        rows, size = [], self.fmu.step_size
        for k in range(first, first + steps):
            if excite:
                self.set(**{n.replace(".", "__"): wave(self.fmu, n, k) for n in self.fmu.of("input")})
            assert self.step(k * size, size) == OK, self.log
            rows.append(self.all())
        return rows

    def save(self):
        state = c_void_p()
        self.check("GetFMUstate", byref(state))
        return state

    def restore(self, state):
        self.check("SetFMUstate", state)

    def release(self, state):
        self.check("FreeFMUstate", byref(state))

    def serialize(self, state):
        size = c_size_t()
        self.check("SerializedFMUstateSize", state, byref(size))
        data = ctypes.create_string_buffer(size.value)
        self.check("SerializeFMUstate", state, data, size)
        return data.raw

    def deserialize(self, data):
        state = c_void_p()
        self.check("DeSerializeFMUstate", data, c_size_t(len(data)), byref(state))
        return state

    def free(self):
        self.fmu.library.fmi2FreeInstance(self.component)


def wave(fmu, name, k):
    """A small input that moves, never the same for two inputs: its start value and a sawtooth of up to a tenth."""
    start = float(fmu.variables[name][0].get("start"))
    return start + 0.1 * ((k * 7 + fmu.references[name] * 3) % 11 - 5) / 5


class Refuse(importlib.abc.MetaPathFinder):
    """Refuses whatever is not the standard library and does not come from the FMU."""

    def __init__(self, resources):
        self.own = {p.stem for p in resources.iterdir()}

    def find_spec(self, name, _path=None, _target=None):
        top = name.split(".")[0]
        if top not in sys.stdlib_module_names and top not in self.own:
            raise ImportError(f"{name} is not the standard library's")


def main(fmu_path, folder, command, *arguments):
    fmu = Fmu(fmu_path, folder)
    sys.meta_path.insert(0, Refuse(fmu.folder / "resources"))
    instance = Instance(fmu)
    if command == "run":  # first step, number of steps
        rows = instance.begin().run(*map(int, arguments))
        instance.check("Terminate")
    elif command == "restore":  # file of a serialized state, first step, number of steps
        state = instance.deserialize(Path(arguments[0]).read_bytes())
        instance.restore(state)
        instance.release(state)
        rows = instance.run(*map(int, arguments[1:]))
    foreign = [m for m in sys.modules if m.split(".")[0] in ("numpy", "scipy", "numba", "twip", "fmpy")]
    instance.free()
    print(json.dumps({"rows": rows, "foreign": foreign, "log": instance.log}))


if __name__ == "__main__":
    main(*sys.argv[1:])
