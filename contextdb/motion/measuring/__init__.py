"""How good motion is: jumps, sliding feet, accelerations, path errors and what was played, in numbers."""
