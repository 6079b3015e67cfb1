"""What every room uses: errors, units, files, checkpoints, workers and figures."""
