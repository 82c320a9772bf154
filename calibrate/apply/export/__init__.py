"""A model in the forms that others read: D-H tables, URDF, MJCF, MATLAB, controllers' own tables.

What a form cannot carry is stated in numbers.
"""

from calibrate.apply.export.controllers import BODIES
from calibrate.apply.export.dh_table import dh_arm, dh_table_of
from calibrate.apply.export.export import ExportForm, FormName, export_model, form_named
from calibrate.apply.export.identified import IdentifiedArm, identified_arm
from calibrate.apply.export.nominal_table import cells, nominal_table

__all__ = [
    "BODIES",
    "ExportForm",
    "FormName",
    "IdentifiedArm",
    "cells",
    "dh_arm",
    "dh_table_of",
    "export_model",
    "form_named",
    "identified_arm",
    "nominal_table",
]
