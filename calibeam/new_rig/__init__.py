"""Rig files from what a user has of his robot: a URDF, an MJCF model, a D-H table, or a rig that is shipped."""
