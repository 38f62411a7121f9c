"""A loop over fmpy's methods, as one writes it by hand: set all connected inputs, step, get all outputs (Jacobi)."""

import csv
from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.ssp.ssd import read_ssd
from protocol import STEP_SIZE, arguments, serve, timed

ssp, unpacked, logs = arguments()
top = read_ssd(str(ssp)).system
descriptions, folders, slaves = {}, {}, {}
for component in top.elements:
    if component.source not in folders:
        folders[component.source] = extract(str(unpacked / component.source))
        descriptions[component.source] = read_model_description(str(unpacked / component.source))
    description = descriptions[component.source]
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=folders[component.source],
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName=component.name,
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    references = {v.name: v.valueReference for v in description.modelVariables}
    outputs = [v.valueReference for v in description.modelVariables if v.causality == "output"]
    slaves[component.name] = (slave, references, outputs, {})
for connection in top.connections:
    wired = slaves[connection.endElement][3]
    source = slaves[connection.startElement]
    place = source[2].index(source[1][connection.startConnector])
    wired[slaves[connection.endElement][1][connection.endConnector]] = (connection.startElement, place)
done = 0


def run(steps: int) -> float:
    """Go on by so many steps."""
    global done
    log = csv.writer((Path(logs) / "methods.csv").open("w", newline="")) if logs else None

    def work() -> None:
        global done
        values = {name: slave.getReal(outputs) for name, (slave, _, outputs, _) in slaves.items()}
        for _ in range(steps):
            for slave, _, _, wired in slaves.values():
                if wired:
                    slave.setReal(list(wired), [values[name][place] for name, place in wired.values()])
                slave.doStep(done * STEP_SIZE, STEP_SIZE)
            done += 1
            values = {name: slave.getReal(outputs) for name, (slave, _, outputs, _) in slaves.items()}
            if log:
                log.writerow([done * STEP_SIZE, *(v for found in values.values() for v in found)])

    return timed(work)


serve(run)
