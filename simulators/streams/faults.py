"""Every fault of motion and streams that can be hidden. A new one is one file and one line here."""

from simulators.streams.early_reading import EarlyReading
from simulators.streams.fault import Fault
from simulators.streams.lagging_encoder import LaggingEncoder
from simulators.streams.late_stamps import LateStamps
from simulators.streams.slipping_encoder import SlippingEncoder
from simulators.streams.swinging_foot import SwingingFoot

FAULTS: tuple[type[Fault], ...] = (LateStamps, LaggingEncoder, SlippingEncoder, EarlyReading, SwingingFoot)
