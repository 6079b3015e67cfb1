"""A page in the browser to look at a rig through: its server, its views and its assets."""
