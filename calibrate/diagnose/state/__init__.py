"""A session fitted with geometry and effects, and its linearisation: all that the search sees."""

from calibrate.diagnose.state.assumed import Assumed
from calibrate.diagnose.state.effect_problem import EffectProblem
from calibrate.diagnose.state.fitted import Fitted, fit_geometry
from calibrate.diagnose.state.linearised import UnseenMisfits
from calibrate.diagnose.state.noise_of_fit import noise_of
from calibrate.diagnose.state.session import Session, session_of
from calibrate.diagnose.state.visible import blind

__all__ = [
    "Assumed",
    "EffectProblem",
    "Fitted",
    "Session",
    "UnseenMisfits",
    "blind",
    "fit_geometry",
    "noise_of",
    "session_of",
]
