"""How far a stable loop is from instability: matrices, delays and operating point."""
