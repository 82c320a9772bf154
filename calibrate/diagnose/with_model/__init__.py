"""Between a diagnosis and a model file: the model that a diagnosis writes, and a known model as the start of another
diagnosis.
"""

from calibrate.diagnose.with_model.from_diagnosis import model_of_diagnosis, model_of_fit
from calibrate.diagnose.with_model.known import ANEW, Known, known_before
from calibrate.diagnose.with_model.later_recording import only_new, refit, with_known_model

__all__ = [
    "ANEW",
    "Known",
    "known_before",
    "model_of_diagnosis",
    "model_of_fit",
    "only_new",
    "refit",
    "with_known_model",
]
