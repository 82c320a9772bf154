"""`python -m calibrate.model.arms`: compile the forward kinematics once, so that no later call waits for it."""

from calibrate.model.arms.compiled import prepare

if __name__ == "__main__":
    prepare()
