"""A bare FMI 3.0 co-simulation host on the standard library, with the methods of the FMI 2.0 one."""

import ctypes
import zipfile
from ctypes import CFUNCTYPE, POINTER, byref, c_bool, c_char_p, c_double, c_int, c_int32, c_size_t, c_uint, c_void_p
from pathlib import Path
from xml.etree import ElementTree

import fmi_host

LOGGER = CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)
C_TYPES = {"Float64": c_double, "Int32": c_int32, "Boolean": c_bool}


class Fmu:
    """An FMU unpacked to a folder, its description read and its library loaded."""

    def __init__(self, path, folder):
        self.folder = Path(folder)
        with zipfile.ZipFile(path) as archive:
            archive.extractall(self.folder)
        root = ElementTree.parse(self.folder / "modelDescription.xml").getroot()
        identifier = root.find("CoSimulation").get("modelIdentifier")
        self.name, self.token = root.get("modelName"), root.get("instantiationToken")
        self.variables = {v.get("name"): v for v in root.find("ModelVariables")}
        self.references = {n: int(v.get("valueReference")) for n, v in self.variables.items()}
        self.types = {n: v.tag for n, v in self.variables.items()}
        self.step_size = float(root.find("DefaultExperiment").get("stepSize"))
        self.library = ctypes.CDLL(str(self.folder / "binaries" / "x86_64-linux" / f"{identifier}.so"))
        self.library.fmi3InstantiateCoSimulation.restype = c_void_p

    def of(self, causality):
        return [n for n, v in self.variables.items() if v.get("causality") == causality]


class Instance(fmi_host.Instance):
    """One instance; every FMI status is returned or, by `check`, required to be OK."""

    def __init__(self, fmu, name="instance"):
        self.fmu = fmu
        self.records = []
        self.logger = LOGGER(lambda _, status, category, message: self.records.append((status, category, message)))
        self.handle = fmu.library.fmi3InstantiateCoSimulation(
            name.encode(), fmu.token.encode(), f"{fmu.folder}/resources/".encode(), c_bool(False), c_bool(True),
            c_bool(False), c_bool(False), None, c_size_t(0), None, self.logger, None,
        )  # fmt: skip
        assert self.handle
        self.component = c_void_p(self.handle)

    @property
    def log(self):
        """Messages as (status, category, text)."""
        return [(s, c.decode(), m.decode()) for s, c, m in self.records]

    def call(self, function, *arguments):
        renamed = function.replace("FMUstate", "FMUState").replace("DeSerialize", "Deserialize")
        return getattr(self.fmu.library, f"fmi3{renamed}")(self.component, *arguments)

    def enter(self, start=0.0):
        self.check("EnterInitializationMode", c_bool(False), c_double(0.0), c_double(start), c_bool(False), c_double())

    def set(self, **values):
        for name, value in values.items():
            name = name.replace("__", ".")
            kind = self.fmu.types[name]
            reference, argument = c_uint(self.fmu.references[name]), C_TYPES[kind](value)
            self.check(f"Set{kind}", byref(reference), c_size_t(1), byref(argument), c_size_t(1))

    def get(self, *names):
        values = []
        for name in names:
            kind = self.fmu.types[name]
            reference, result = c_uint(self.fmu.references[name]), C_TYPES[kind]()
            self.check(f"Get{kind}", byref(reference), c_size_t(1), byref(result), c_size_t(1))
            values.append(result.value)
        return values[0] if len(names) == 1 else values

    def all(self):
        """The bits of every variable but time."""
        return [float(x).hex() for x in self.get(*(n for n in self.fmu.variables if n != "time"))]

    def step(self, time, size):
        flags, reached = (c_bool * 3)(), c_double()
        pointers = [ctypes.cast(ctypes.addressof(flags) + i, POINTER(c_bool)) for i in range(3)]
        return self.call("DoStep", c_double(time), c_double(size), c_bool(True), *pointers, byref(reached))

    def run(self, first, steps):
        """Do steps number `first` and on, with the inputs of the FMI 2.0 host; return the bits after each."""
        rows, size = [], self.fmu.step_size
        for k in range(first, first + steps):
            self.set(**{n.replace(".", "__"): wave(self.fmu, n, k) for n in self.fmu.of("input")})
            assert self.step(k * size, size) == 0, self.log
            rows.append(self.all())
        return rows

    def free(self):
        self.fmu.library.fmi3FreeInstance(self.component)


def wave(fmu, name, k):
    """The wave of the FMI 2.0 host: value references are the same."""
    return float(fmu.variables[name].get("start")) + 0.1 * ((k * 7 + fmu.references[name] * 3) % 11 - 5) / 5
