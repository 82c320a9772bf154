"""What a sensor needs to check its own readings for gross errors, and the record of a gross error."""
