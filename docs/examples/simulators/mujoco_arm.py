"""A user's MJCF as the simulation: joints set as the samples say, the place of a site as the tracker would see it.

python mujoco_arm.py arm.xml samples.csv
"""

import csv
import sys

import mujoco


def main(model_file, samples_file):
    model = mujoco.MjModel.from_xml_path(model_file)
    data = mujoco.MjData(model)
    answer = csv.writer(sys.stdout)
    answer.writerow(["x_m", "y_m", "z_m"])
    with open(samples_file, encoding="utf-8") as samples:
        for row in csv.DictReader(samples):
            for joint in range(1, 7):
                data.joint(f"joint{joint}").qpos = float(row[f"q{joint}_rad"])
            mujoco.mj_kinematics(model, data)
            answer.writerow(data.site("reflector").xpos)


if __name__ == "__main__":
    main(*sys.argv[1:])
