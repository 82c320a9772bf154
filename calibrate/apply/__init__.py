"""What one does with a model: predict readings, correct poses and programs, export."""
