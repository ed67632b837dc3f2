"""What the formulas of scalar.py stand on: sums and products with their errors, sine and cosine."""
