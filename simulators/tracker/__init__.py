"""An instrument that prints where its target is, line by line: a laser tracker's exporter, a camera's logger."""
