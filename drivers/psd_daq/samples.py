"""From messages of samples to a block in SI units."""

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from drivers.device import Block
from drivers.psd_daq.messages import Samples
from drivers.psd_daq.sequence import SequenceCount


def to_block(arrived: Sequence[tuple[float, Samples]], count: SequenceCount) -> Block:
    """One block of all `arrived` (host time of arrival, samples), at least one, in the order they came."""
    counts = [len(samples.flags) for _, samples in arrived]
    values = {
        "photocurrent_a": np.concatenate([samples.photocurrent_pa for _, samples in arrived]) * 1e-12,
        "flags": np.concatenate([samples.flags for _, samples in arrived]).astype(np.uint16),
        "temperature_degC": np.repeat([samples.temperature_degC for _, samples in arrived], counts),
    }
    starts = np.repeat([samples.time_us * 1e-6 for _, samples in arrived], counts)
    periods = np.repeat([samples.period_ns * 1e-9 for _, samples in arrived], counts)
    firsts = [count.unwrap(samples.sequence, len(samples.flags)) for _, samples in arrived]
    within = np.concatenate([np.arange(n) for n in counts])
    return Block(
        host_s=np.repeat([host_s for host_s, _ in arrived], counts).astype(np.float64),
        device_s=(starts + within * periods).astype(np.float64),
        sequence=np.repeat(np.array(firsts, dtype=np.int64), counts) + within,
        values=MappingProxyType(values),
    )
