"""Hardware in the loop: the string behind a socket, in real time, for a drive's software."""
