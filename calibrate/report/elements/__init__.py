"""What pages are made of: HTML elements, SVG figures, tones, the verdict's record."""
