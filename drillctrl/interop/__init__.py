"""Ways into python-control and back."""
