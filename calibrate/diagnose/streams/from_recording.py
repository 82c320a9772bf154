"""The streams of a recording beside its diagnosis: what is wrong with them, by the model that was fitted."""

from acquisition.recording import Recording
from calibrate.diagnose.fitted import Fitted
from calibrate.diagnose.streams.between_encoders import causes_of
from calibrate.diagnose.streams.examine import StreamReport, examine
from calibrate.diagnose.streams.predicted_spots import predicted_spots
from calibrate.diagnose.streams.recorded import devices_of
from calibrate.diagnose.streams.sample_times import around, sample_windows


def streams_of(recording: Recording, fitted: Fitted | None) -> StreamReport | None:
    """None where no stream was recorded. Without a fit the clock of the spots stays open."""
    devices = devices_of(recording)
    if not devices:
        return None
    windows, predicted = sample_windows(recording), None
    if fitted is not None and "spots" in devices and "joints" in devices:
        placed = around(recording, windows, devices["spots"], devices["joints"])
        predicted = None if placed is None else predicted_spots(fitted, placed)
    return examine(devices, predicted, windows, None if fitted is None else causes_of(fitted))
