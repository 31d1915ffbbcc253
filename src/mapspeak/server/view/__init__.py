"""The live page: a robot's map, camera, calls and drives in a browser, and a person's commands."""
