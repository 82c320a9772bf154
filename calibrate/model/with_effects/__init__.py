"""The chain with effects in it: frames under perturbations at its ports, and effects of a model file at any rows."""
