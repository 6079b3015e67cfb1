"""What a rig has recorded: read, looked at, and a string fitted to it."""
