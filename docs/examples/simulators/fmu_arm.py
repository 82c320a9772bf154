"""An FMU as the simulation, through FMPy: inputs q1_rad to q6_rad, outputs x_m, y_m, z_m, one step a sample.

python fmu_arm.py arm.fmu samples.csv
"""

import csv
import sys

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

INPUTS, OUTPUTS, STEP_S = [f"q{joint}_rad" for joint in range(1, 7)], ["x_m", "y_m", "z_m"], 1.0


def main(fmu_file, samples_file):
    about = read_model_description(fmu_file)
    number = {variable.name: variable.valueReference for variable in about.modelVariables}
    inputs, outputs = [number[name] for name in INPUTS], [number[name] for name in OUTPUTS]
    identifier = about.coSimulation.modelIdentifier
    fmu = FMU2Slave(guid=about.guid, unzipDirectory=extract(fmu_file), modelIdentifier=identifier)
    fmu.instantiate()
    fmu.setupExperiment()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    answer = csv.writer(sys.stdout)
    answer.writerow(OUTPUTS)
    with open(samples_file, encoding="utf-8") as samples:
        for step, row in enumerate(csv.DictReader(samples)):
            fmu.setReal(inputs, [float(row[name]) for name in INPUTS])
            fmu.doStep(step * STEP_S, STEP_S)
            answer.writerow(fmu.getReal(outputs))


if __name__ == "__main__":
    main(*sys.argv[1:])
