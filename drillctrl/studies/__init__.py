"""Many runs or designs side by side: comparisons, campaigns of disturbances, vibration maps."""
