"""Clips that were recorded together: one row, several roles, chosen, cast and played as one."""
