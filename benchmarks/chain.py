"""Builds chains of small C FMUs: systems in which a step costs next to nothing but what the master adds.

Each FMU is a first-order lag with any number of states, `y[i]' = (u[i] - y[i]) / time_constant`, by Euler's method with
the communication step, and FMU n feeds FMU n + 1. Needs a C compiler (`cc`).
"""

import subprocess
import tempfile
import zipfile
from pathlib import Path

import fmpy

from twip.errors import TwipError

SOURCE = """\
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double u[SIGNALS], y[SIGNALS]; } Lag;
#define EXPORT __attribute__((visibility("default")))
EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const names[]) { return 0; }
EXPORT void *fmi2Instantiate(const char *name, int k, const char *guid, const char *place, const void *f, int v, int l)
{ return calloc(1, sizeof(Lag)); }
EXPORT void fmi2FreeInstance(void *c) { free(c); }
EXPORT int fmi2SetupExperiment(void *c, int d, double t, double start, int e, double stop) { return 0; }
EXPORT int fmi2EnterInitializationMode(void *c) { return 0; }
EXPORT int fmi2ExitInitializationMode(void *c) { return 0; }
EXPORT int fmi2Terminate(void *c) { return 0; }
EXPORT int fmi2Reset(void *c) { memset(c, 0, sizeof(Lag)); return 0; }
EXPORT int fmi2GetReal(void *c, const unsigned *r, size_t n, double *x)
{ for (size_t i = 0; i < n; i++) x[i] = ((double *)c)[r[i]]; return 0; }
EXPORT int fmi2SetReal(void *c, const unsigned *r, size_t n, const double *x)
{ for (size_t i = 0; i < n; i++) ((double *)c)[r[i]] = x[i]; return 0; }
#define REFUSE(name) EXPORT int name(void *c, const unsigned *r, size_t n, void *x) { return n ? 3 : 0; }
REFUSE(fmi2GetInteger) REFUSE(fmi2GetBoolean) REFUSE(fmi2GetString)
REFUSE(fmi2SetInteger) REFUSE(fmi2SetBoolean) REFUSE(fmi2SetString)
EXPORT int fmi2GetFMUstate(void *c, void **s) { return 3; }
EXPORT int fmi2SetFMUstate(void *c, void *s) { return 3; }
EXPORT int fmi2FreeFMUstate(void *c, void **s) { return 3; }
EXPORT int fmi2SerializedFMUstateSize(void *c, void *s, size_t *n) { return 3; }
EXPORT int fmi2SerializeFMUstate(void *c, void *s, char *d, size_t n) { return 3; }
EXPORT int fmi2DeSerializeFMUstate(void *c, const char *d, size_t n, void **s) { return 3; }
EXPORT int fmi2GetDirectionalDerivative(void *c, const unsigned *a, size_t n, const unsigned *b, size_t m,
 const double *x, double *y) { return 3; }
EXPORT int fmi2SetRealInputDerivatives(void *c, const unsigned *r, size_t n, const int *o, const double *x)
{ return 3; }
EXPORT int fmi2GetRealOutputDerivatives(void *c, const unsigned *r, size_t n, const int *o, double *x) { return 3; }
EXPORT int fmi2CancelStep(void *c) { return 3; }
EXPORT int fmi2GetStatus(void *c, int k, int *x) { return 2; }
EXPORT int fmi2GetRealStatus(void *c, int k, double *x) { return 2; }
EXPORT int fmi2GetIntegerStatus(void *c, int k, int *x) { return 2; }
EXPORT int fmi2GetBooleanStatus(void *c, int k, int *x) { return 2; }
EXPORT int fmi2GetStringStatus(void *c, int k, const char **x) { return 2; }
EXPORT int fmi2DoStep(void *c, double t, double h, int prior)
{ Lag *l = c; for (int i = 0; i < SIGNALS; i++) l->y[i] += h * (l->u[i] - l->y[i]) / 0.05; return 0; }
"""
STEP_SIZE = 0.001


def build_lag(signals: int, output: Path) -> None:
    """Compile the FMU with `signals` inputs and as many outputs."""
    variables, structure = [], []
    for kind, first in (("u", 0), ("y", signals)):
        for i in range(signals):
            causality = 'causality="input"' if kind == "u" else 'causality="output" initial="exact"'
            variables.append(
                f'<ScalarVariable name="{kind}{i}" valueReference="{first + i}" {causality} variability="continuous">'
                '<Real start="0"/></ScalarVariable>'
            )
            if kind == "y":
                structure.append(f'<Unknown index="{first + i + 1}" dependencies=""/>')
    description = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiModelDescription fmiVersion="2.0" modelName="lag" guid="{lag}">'
        '<CoSimulation modelIdentifier="lag" canHandleVariableCommunicationStepSize="true"/>'
        f'<DefaultExperiment stepSize="{STEP_SIZE}"/><ModelVariables>{"".join(variables)}</ModelVariables>'
        f"<ModelStructure><Outputs>{''.join(structure)}</Outputs></ModelStructure></fmiModelDescription>"
    )
    with tempfile.TemporaryDirectory() as name:
        source, library = Path(name) / "lag.c", Path(name) / "lag.so"
        source.write_text(SOURCE, encoding="utf-8")
        command = ["cc", "-O2", "-shared", "-fPIC", f"-DSIGNALS={signals}", str(source), "-o", str(library)]
        try:
            subprocess.run(command, check=True, capture_output=True)
        except FileNotFoundError:
            raise TwipError("the chains of small FMUs need a C compiler (cc)") from None
        with zipfile.ZipFile(output, "w") as archive:
            archive.writestr("modelDescription.xml", description)
            archive.write(library, f"binaries/{fmpy.platform}/lag.so")


def write_chain(folder: Path, fmus: int, signals: int = 1) -> Path:
    """Write `chain.ssp` and its unpacked form into `folder`; return the archive."""
    unpacked = folder / "chain"
    (unpacked / "resources").mkdir(parents=True, exist_ok=True)
    build_lag(signals, unpacked / "resources" / "lag.fmu")
    ports = "".join(
        f'<ssd:Connector name="{name}{i}" kind="{kind}"><ssc:Real/></ssd:Connector>'
        for name, kind in (("u", "input"), ("y", "output"))
        for i in range(signals)
    )
    elements = "".join(
        f'<ssd:Component name="lag{n}" type="application/x-fmu-sharedlibrary" source="resources/lag.fmu">'
        f"<ssd:Connectors>{ports}</ssd:Connectors></ssd:Component>"
        for n in range(fmus)
    )
    links = "".join(
        f'<ssd:Connection startElement="lag{n}" startConnector="y{i}" endElement="lag{n + 1}" endConnector="u{i}"/>'
        for n in range(fmus - 1)
        for i in range(signals)
    )
    space = "http://ssp-standard.org/SSP1/SystemStructure"
    connections = f"<ssd:Connections>{links}</ssd:Connections>" if links else ""
    (unpacked / "SystemStructure.ssd").write_text(
        f'<ssd:SystemStructureDescription xmlns:ssd="{space}Description" xmlns:ssc="{space}Common" version="1.0"'
        f' name="chain"><ssd:System name="chain"><ssd:Elements>{elements}</ssd:Elements>{connections}</ssd:System>'
        '<ssd:DefaultExperiment startTime="0" stopTime="1"/></ssd:SystemStructureDescription>',
        encoding="utf-8",
    )
    archive = folder / "chain.ssp"
    with zipfile.ZipFile(archive, "w") as file:
        for path in sorted(p for p in unpacked.rglob("*") if p.is_file()):
            file.write(path, path.relative_to(unpacked).as_posix())
    return archive
