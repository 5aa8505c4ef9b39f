"""Walking by phase: cycles that are blended by speed, footsteps that are predicted, legs that reach them. Moves no body."""
