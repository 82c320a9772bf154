"""Sessions of a driven arm with a tracker: which poses (`poses`), and the whole job from devices to report (`run`)."""
